// sender/constraint_tree.cpp
#include "sender/constraint_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace ellicast::sender {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// F0 + t F1.
QuadraticForm combine(const QuadraticForm& F0, double t, const QuadraticForm& F1) {
    QuadraticForm F;
    F.xx = F0.xx + t * F1.xx;
    F.yy = F0.yy + t * F1.yy;
    F.zz = F0.zz + t * F1.zz;
    F.xy = F0.xy + t * F1.xy;
    F.xz = F0.xz + t * F1.xz;
    F.yz = F0.yz + t * F1.yz;
    F.x = F0.x + t * F1.x;
    F.y = F0.y + t * F1.y;
    F.z = F0.z + t * F1.z;
    F.c = F0.c + t * F1.c;
    return F;
}

// Bound on the rounding error of an evaluation of F at coordinates of at most `extent`: a few units
// in the last place of the sum of the terms' magnitudes. A point this close to F = 0 is decided by
// its t, so that ties are broken by index whatever the order of the search.
double rounding_slack(const QuadraticForm& F, double extent) {
    const double quadratic = std::abs(F.xx) + std::abs(F.yy) + std::abs(F.zz) + std::abs(F.xy) +
                             std::abs(F.xz) + std::abs(F.yz);
    const double linear = std::abs(F.x) + std::abs(F.y) + std::abs(F.z);
    constexpr double kUnits = 32.0 * std::numeric_limits<double>::epsilon();
    return kUnits * ((quadratic * extent + linear) * extent + std::abs(F.c));
}

// How many of n leaves go to the left: half of them, rounded to whole subtrees of eight's powers,
// so that every eight consecutive leaves, and every eight groups of those, are a compact part of
// space.
std::size_t left_leaves(std::size_t n, std::size_t children) {
    std::size_t unit = 1;
    while (unit * children < n) unit *= children;
    const std::size_t units = (n + unit - 1) / unit;
    return units / 2 * unit;
}

}  // namespace

QuadraticForm::QuadraticForm(const Eigen::Matrix4d& Q)
    : xx(Q(0, 0)),
      yy(Q(1, 1)),
      zz(Q(2, 2)),
      xy(Q(0, 1) + Q(1, 0)),
      xz(Q(0, 2) + Q(2, 0)),
      yz(Q(1, 2) + Q(2, 1)),
      x(Q(0, 3) + Q(3, 0)),
      y(Q(1, 3) + Q(3, 1)),
      z(Q(2, 3) + Q(3, 2)),
      c(Q(3, 3)) {}

std::optional<double> contact_parameter(const QuadraticForm& F0, const QuadraticForm& F1,
                                        const Vector3d& x) {
    const double f1 = F1(x);
    if (!(f1 < 0.0)) return std::nullopt;
    return std::max(0.0, -F0(x) / f1);  // [BK02] eq. (2)
}

ConstraintTree::ConstraintTree(std::vector<Vector3d> points) : points_(std::move(points)) {
    assert(points_.size() < std::numeric_limits<std::uint32_t>::max());
    if (points_.empty()) return;
    for (const Vector3d& p : points_) {
        assert(p.allFinite());
        extent_ = std::max(extent_, p.cwiseAbs().maxCoeff());
    }
    std::vector<std::uint32_t> order(points_.size());
    std::iota(order.begin(), order.end(), 0u);
    build_leaves(order);
    build_nodes();
}

void ConstraintTree::build_leaves(std::vector<std::uint32_t>& order) {
    const std::size_t leaf_count = (order.size() + kLeafPoints - 1) / kLeafPoints;
    // Splits the range of leaves [first, last) across the longest side of its points' box.
    const auto split = [&](const auto& self, std::size_t first, std::size_t last) -> void {
        const std::size_t begin = first * kLeafPoints;
        const std::size_t end = std::min(last * kLeafPoints, order.size());
        if (last - first <= 1) return;
        AlignedBox3d box;
        for (std::size_t i = begin; i < end; ++i) box.extend(points_[order[i]]);
        Eigen::Index axis = 0;
        box.sizes().maxCoeff(&axis);
        const std::size_t middle = first + left_leaves(last - first, kChildren);
        std::nth_element(order.begin() + static_cast<std::ptrdiff_t>(begin),
                         order.begin() + static_cast<std::ptrdiff_t>(middle * kLeafPoints),
                         order.begin() + static_cast<std::ptrdiff_t>(end),
                         [&](std::uint32_t a, std::uint32_t b) {
                             const double pa = points_[a][axis], pb = points_[b][axis];
                             return pa != pb ? pa < pb : a < b;
                         });
        self(self, first, middle);
        self(self, middle, last);
    };
    split(split, 0, leaf_count);

    leaves_.resize(leaf_count);
    indices_.resize(leaf_count);
    for (std::size_t leaf = 0; leaf < leaf_count; ++leaf) {
        for (std::size_t i = 0; i < kLeafPoints; ++i) {
            const std::size_t at = std::min(leaf * kLeafPoints + i, order.size() - 1);
            const Vector3d& p = points_[order[at]];
            leaves_[leaf].x[i] = p[0];
            leaves_[leaf].y[i] = p[1];
            leaves_[leaf].z[i] = p[2];
            indices_[leaf][i] = order[at];
        }
    }
}

void ConstraintTree::build_nodes() {
    std::vector<AlignedBox3d> boxes;
    boxes.reserve(leaves_.size());
    for (const auto& indices : indices_) {
        AlignedBox3d box;
        for (const std::uint32_t i : indices) box.extend(points_[i]);
        boxes.push_back(box);
    }
    do {
        std::vector<Node> nodes((boxes.size() + kChildren - 1) / kChildren, Node{});
        std::vector<AlignedBox3d> parents(nodes.size());
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            Node& node = nodes[i / kChildren];
            const std::size_t child = i % kChildren;
            const Vector3d m = boxes[i].center();
            // Largest distance from the rounded centre, so that the box is never too small.
            const Vector3d h = (boxes[i].max() - m).cwiseMax(m - boxes[i].min());
            node.mx[child] = m[0];
            node.my[child] = m[1];
            node.mz[child] = m[2];
            node.hx[child] = h[0];
            node.hy[child] = h[1];
            node.hz[child] = h[2];
            parents[i / kChildren].extend(boxes[i]);
        }
        levels_.push_back(std::move(nodes));
        boxes = std::move(parents);
    } while (boxes.size() > 1);
}

class ConstraintTree::Query {
  public:
    Query(const ConstraintTree& tree, const QuadraticForm& F0, const QuadraticForm& F1,
          double t_max)
        : tree_(tree), F0_(F0), F1_(F1), best_{std::numeric_limits<std::uint32_t>::max(), t_max} {
        tighten();
    }

    // Exact decision on one point.
    void offer(std::uint32_t point) {
        const std::optional<double> t = contact_parameter(F0_, F1_, tree_.points_[point]);
        if (!t || *t > best_.t || (*t == best_.t && point >= best_.point)) return;
        best_ = {point, *t};
        tighten();
    }

    void visit(std::size_t level, std::size_t node_index) {
        const Node& node = tree_.levels_[level][node_index];
        const std::size_t below =
            level == 0 ? tree_.leaves_.size() : tree_.levels_[level - 1].size();
        const std::size_t first = node_index * kChildren;
        const std::size_t count = std::min(kChildren, below - first);
        std::array<double, kChildren> bound;
        lower_bounds(node, bound);

        // Most promising child first: it holds the deepest intrusion into the grown shape.
        std::array<std::uint8_t, kChildren> queue;
        std::size_t queued = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (bound[i] > slack_) continue;
            std::size_t at = queued++;
            for (; at > 0 && bound[queue[at - 1]] > bound[i]; --at) queue[at] = queue[at - 1];
            queue[at] = static_cast<std::uint8_t>(i);
        }
        const double t_before = best_.t;
        for (std::size_t k = 0; k < queued; ++k) {
            const std::size_t child = queue[k];
            if (best_.t < t_before && lower_bound(node, child) > slack_) continue;
            if (level == 0) {
                scan_leaf(first + child);
            } else {
                visit(level - 1, first + child);
            }
        }
    }

    [[nodiscard]] std::optional<Contact> result() const {
        if (best_.point == std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
        return best_;
    }

  private:
    void tighten() {
        F_ = combine(F0_, best_.t, F1_);
        slack_ = rounding_slack(F_, tree_.extent_);
    }

    // F(m) - sum_i |dF/dx_i(m)| h_i of one child.
    [[nodiscard]] double lower_bound(const Node& node, std::size_t i) const {
        const QuadraticForm& F = F_;
        const double x = node.mx[i], y = node.my[i], z = node.mz[i];
        const double gx = 2.0 * F.xx * x + F.xy * y + F.xz * z + F.x;
        const double gy = F.xy * x + 2.0 * F.yy * y + F.yz * z + F.y;
        const double gz = F.xz * x + F.yz * y + 2.0 * F.zz * z + F.z;
        // Euler: 2 F = x'grad + (linear part) + 2 c.
        const double value = 0.5 * (x * (gx + F.x) + y * (gy + F.y) + z * (gz + F.z)) + F.c;
        return value - std::abs(gx) * node.hx[i] - std::abs(gy) * node.hy[i] -
               std::abs(gz) * node.hz[i];
    }

    void lower_bounds(const Node& node, std::array<double, kChildren>& bound) const {
        for (std::size_t i = 0; i < kChildren; ++i) bound[i] = lower_bound(node, i);
    }

    void scan_leaf(std::size_t index) {
        const Leaf& leaf = tree_.leaves_[index];
        const QuadraticForm F = F_;
        std::array<double, kLeafPoints> value;
        for (std::size_t i = 0; i < kLeafPoints; ++i) {
            value[i] = F(leaf.x[i], leaf.y[i], leaf.z[i]);
        }
        double least = value[0];
        for (std::size_t i = 1; i < kLeafPoints; ++i) least = std::min(least, value[i]);
        if (least > slack_) return;
        for (std::size_t i = 0; i < kLeafPoints; ++i) {
            if (value[i] <= slack_) offer(tree_.indices_[index][i]);
        }
    }

    const ConstraintTree& tree_;
    const QuadraticForm F0_, F1_;
    QuadraticForm F_;  // F0 + t F1 at the best t so far
    double slack_ = 0;
    Contact best_;
};

std::optional<Contact> ConstraintTree::first_contact(const QuadraticForm& F0,
                                                     const QuadraticForm& F1, double t_max,
                                                     std::span<const std::uint32_t> guesses) const {
    if (points_.empty()) return std::nullopt;
    Query query(*this, F0, F1, t_max);
    for (const std::uint32_t guess : guesses) query.offer(guess);
    query.visit(levels_.size() - 1, 0);
    return query.result();
}

}  // namespace ellicast::sender
