// sender/constraint_tree.cpp
#include "sender/constraint_tree.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
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

using Mask = std::uint32_t;

// Bit i says whether value i is at most `limit`; no branches.
template <std::size_t N>
inline Mask at_most(const std::array<double, N>& values, double limit) {
    Mask mask = 0;
    for (std::size_t i = 0; i < N; ++i) mask |= static_cast<Mask>(values[i] <= limit) << i;
    return mask;
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

// A point with its index, moved together while sorting.
struct Slot {
    Vector3d position;
    std::uint32_t index = 0;
};

// Sorts slots[begin, end), leaves [begin / size, ...), by splits across the longest side of their
// box.
void split(std::span<Slot> slots, std::size_t leaf_points, std::size_t children) {
    const std::size_t leaves = (slots.size() + leaf_points - 1) / leaf_points;
    if (leaves <= 1) return;
    AlignedBox3d box;
    for (const Slot& slot : slots) box.extend(slot.position);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = left_leaves(leaves, children) * leaf_points;
    std::nth_element(slots.begin(), slots.begin() + static_cast<std::ptrdiff_t>(middle),
                     slots.end(), [axis](const Slot& a, const Slot& b) {
                         const double pa = a.position[axis], pb = b.position[axis];
                         return pa != pb ? pa < pb : a.index < b.index;
                     });
    split(slots.first(middle), leaf_points, children);
    split(slots.subspan(middle), leaf_points, children);
}

// Centre and half-axes (columns) of a box that holds the points, along their principal axes.
struct TurnedBox {
    Vector3d center;
    Eigen::Matrix3d half_axes;
};

TurnedBox enclose(const std::vector<Vector3d>& points, std::span<const std::uint32_t> which) {
    Vector3d mean = Vector3d::Zero();
    for (const std::uint32_t i : which) mean += points[i];
    mean /= static_cast<double>(which.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const std::uint32_t i : which) {
        const Vector3d d = points[i] - mean;
        covariance += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance);
    // The closed-form solver's vectors are orthogonal to some 1e-8 only; the box must hold to
    // rounding.
    Eigen::Matrix3d axes;
    axes.col(0) = eigen.eigenvectors().col(2).normalized();
    axes.col(1) = axes.col(0).cross(eigen.eigenvectors().col(0)).normalized();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    AlignedBox3d box;  // in the turned frame, about the mean
    for (const std::uint32_t i : which) box.extend(Vector3d(axes.transpose() * (points[i] - mean)));
    return {mean + axes * box.center(), axes * (0.5 * box.sizes()).asDiagonal()};
}

}  // namespace

ConstraintTree::ConstraintTree(std::vector<Vector3d> points) : points_(std::move(points)) {
    assert(points_.size() < std::numeric_limits<std::uint32_t>::max());
    sort_into_leaves();
    fill_leaves();
    build_nodes();
}

ConstraintTree::ConstraintTree(std::vector<Vector3d> points, const ConstraintTree& like)
    : points_(std::move(points)), order_(like.order_) {
    assert(points_.size() == like.points_.size());
    fill_leaves();
    build_nodes();
}

void ConstraintTree::sort_into_leaves() {
    std::vector<Slot> slots(points_.size());
    for (std::uint32_t i = 0; i < slots.size(); ++i) slots[i] = {points_[i], i};
    split(slots, kLeafPoints, kChildren);
    order_.reserve(slots.size());
    for (const Slot& slot : slots) order_.push_back(slot.index);
}

void ConstraintTree::fill_leaves() {
    for (const Vector3d& p : points_) {
        assert(p.allFinite());
        extent_ = std::max(extent_, p.cwiseAbs().maxCoeff());
    }
    leaves_.resize((order_.size() + kLeafPoints - 1) / kLeafPoints);
    for (std::size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
        for (std::size_t i = 0; i < kLeafPoints; ++i) {
            const std::size_t slot = std::min(leaf * kLeafPoints + i, order_.size() - 1);
            const Vector3d& p = points_[order_[slot]];
            leaves_[leaf].x[i] = p[0];
            leaves_[leaf].y[i] = p[1];
            leaves_[leaf].z[i] = p[2];
        }
    }
}

void ConstraintTree::build_nodes() {
    if (leaves_.empty()) return;
    std::size_t children = leaves_.size();
    std::size_t points_of_child = kLeafPoints;
    do {
        std::vector<Node> nodes((children + kChildren - 1) / kChildren, Node{});
        for (std::size_t i = 0; i < children; ++i) {
            const std::size_t first = i * points_of_child;
            const std::size_t count = std::min(points_of_child, order_.size() - first);
            const TurnedBox box = enclose(points_, std::span(order_).subspan(first, count));
            Node& node = nodes[i / kChildren];
            const std::size_t child = i % kChildren;
            node.mx[child] = box.center[0];
            node.my[child] = box.center[1];
            node.mz[child] = box.center[2];
            for (std::size_t k = 0; k < 9; ++k) {
                // Column-major: the three components of the first axis come first.
                node.half_axes[k][child] = box.half_axes.data()[k];
            }
        }
        children = nodes.size();
        points_of_child *= kChildren;
        levels_.push_back(std::move(nodes));
    } while (children > 1);
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
        Mask open = reaching_boxes(F_, node, slack_) & ((Mask{1} << count) - 1);
        while (open != 0) {
            const std::size_t child = first + static_cast<std::size_t>(std::countr_zero(open));
            open &= open - 1;
            const double t_before = best_.t;
            if (level == 0) {
                scan_leaf(child);
            } else {
                visit(level - 1, child);
            }
            if (best_.t < t_before) open &= reaching_boxes(F_, node, slack_);
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

    // F(m) - sum_i |grad F(m)'a_i| of one child.
    [[nodiscard]] static double box_bound(const QuadraticForm& F, const Node& node, std::size_t i) {
        const double x = node.mx[i], y = node.my[i], z = node.mz[i];
        const double gx = 2.0 * F.xx * x + F.xy * y + F.xz * z + F.x;
        const double gy = F.xy * x + 2.0 * F.yy * y + F.yz * z + F.y;
        const double gz = F.xz * x + F.yz * y + 2.0 * F.zz * z + F.z;
        // Euler: 2 F = m'grad + (linear part) + 2 c.
        const double value = 0.5 * (x * (gx + F.x) + y * (gy + F.y) + z * (gz + F.z)) + F.c;
        const auto& a = node.half_axes;
        return value - std::abs(gx * a[0][i] + gy * a[1][i] + gz * a[2][i]) -
               std::abs(gx * a[3][i] + gy * a[4][i] + gz * a[5][i]) -
               std::abs(gx * a[6][i] + gy * a[7][i] + gz * a[8][i]);
    }

    // One bit a child: whether its box reaches into F <= slack.
    static Mask reaching_boxes(const QuadraticForm& F, const Node& node, double slack) {
        std::array<double, kChildren> bound;
        for (std::size_t i = 0; i < kChildren; ++i) bound[i] = box_bound(F, node, i);
        return at_most(bound, slack);
    }

    // One bit a point of the leaf: whether F <= slack there.
    static Mask reaching_points(const QuadraticForm& F, const Leaf& leaf, double slack) {
        std::array<double, kLeafPoints> value;
        for (std::size_t i = 0; i < kLeafPoints; ++i) {
            value[i] = F(leaf.x[i], leaf.y[i], leaf.z[i]);
        }
        return at_most(value, slack);
    }

    void scan_leaf(std::size_t index) {
        Mask inside = reaching_points(F_, tree_.leaves_[index], slack_);
        for (; inside != 0; inside &= inside - 1) {
            const std::size_t slot =
                index * kLeafPoints + static_cast<std::size_t>(std::countr_zero(inside));
            offer(tree_.order_[std::min(slot, tree_.order_.size() - 1)]);
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
