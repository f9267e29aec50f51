// sender/box_tree.cpp
#include "sender/box_tree.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace ellicast::sender {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

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

void split(std::span<Slot> slots, std::size_t per_leaf, std::size_t children) {
    const std::size_t leaves = (slots.size() + per_leaf - 1) / per_leaf;
    if (leaves <= 1) return;
    AlignedBox3d box;
    for (const Slot& slot : slots) box.extend(slot.position);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = left_leaves(leaves, children) * per_leaf;
    std::nth_element(slots.begin(), slots.begin() + static_cast<std::ptrdiff_t>(middle),
                     slots.end(), [axis](const Slot& a, const Slot& b) {
                         const double pa = a.position[axis], pb = b.position[axis];
                         return pa != pb ? pa < pb : a.index < b.index;
                     });
    split(slots.first(middle), per_leaf, children);
    split(slots.subspan(middle), per_leaf, children);
}

// Centre and half-axes (columns) of a box that holds the points, along their principal axes.
struct TurnedBox {
    Vector3d center;
    Eigen::Matrix3d half_axes;
};

TurnedBox enclose(std::span<const Vector3d> points) {
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& p : points) mean += p;
    mean /= static_cast<double>(points.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const Vector3d& p : points) covariance += (p - mean) * (p - mean).transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance);
    // The closed-form solver's vectors are orthogonal to some 1e-8 only; the box must hold to
    // rounding.
    Eigen::Matrix3d axes;
    axes.col(0) = eigen.eigenvectors().col(2).normalized();
    axes.col(1) = axes.col(0).cross(eigen.eigenvectors().col(0)).normalized();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    AlignedBox3d box;  // in the turned frame, about the mean
    for (const Vector3d& p : points) box.extend(Vector3d(axes.transpose() * (p - mean)));
    return {mean + axes * box.center(), axes * (0.5 * box.sizes()).asDiagonal()};
}

}  // namespace

std::vector<std::uint32_t> compact_order(const std::vector<Vector3d>& points,
                                         std::size_t per_leaf) {
    std::vector<Slot> slots(points.size());
    for (std::uint32_t i = 0; i < slots.size(); ++i) slots[i] = {points[i], i};
    constexpr std::size_t kChildren = 8;  // as BoxTree has them
    split(slots, per_leaf, kChildren);
    std::vector<std::uint32_t> order;
    order.reserve(slots.size());
    for (const Slot& slot : slots) order.push_back(slot.index);
    return order;
}

BoxTree::BoxTree(std::span<const Vector3d> points, std::size_t per_leaf)
    : leaves_((points.size() + per_leaf - 1) / per_leaf) {
    std::size_t children = leaves_;
    std::size_t per_child = per_leaf;
    while (children > 0) {
        std::vector<Node> nodes((children + kChildren - 1) / kChildren, Node{});
        for (std::size_t i = 0; i < children; ++i) {
            const std::size_t first = i * per_child;
            const TurnedBox box =
                enclose(points.subspan(first, std::min(per_child, points.size() - first)));
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
        levels_.push_back(std::move(nodes));
        children = levels_.back().size() > 1 ? levels_.back().size() : 0;
        per_child *= kChildren;
    }
}

std::uint32_t BoxTree::reaching(const Node& node, const QuadraticForm& F, double slack) {
    std::array<double, kChildren> bound;
    const auto& a = node.half_axes;
    for (std::size_t i = 0; i < kChildren; ++i) {
        const double x = node.mx[i], y = node.my[i], z = node.mz[i];
        const double gx = 2.0 * F.xx * x + F.xy * y + F.xz * z + F.x;
        const double gy = F.xy * x + 2.0 * F.yy * y + F.yz * z + F.y;
        const double gz = F.xz * x + F.yz * y + 2.0 * F.zz * z + F.z;
        // Euler: 2 F = m'grad + (linear part) + 2 c.
        const double value = 0.5 * (x * (gx + F.x) + y * (gy + F.y) + z * (gz + F.z)) + F.c;
        bound[i] = value - std::abs(gx * a[0][i] + gy * a[1][i] + gz * a[2][i]) -
                   std::abs(gx * a[3][i] + gy * a[4][i] + gz * a[5][i]) -
                   std::abs(gx * a[6][i] + gy * a[7][i] + gz * a[8][i]);
    }
    return at_most(bound, slack);
}

}  // namespace ellicast::sender
