// sender/box_tree.hpp
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sender/quadratic_form.hpp"

namespace ellicast::sender {

/// An order of points in which every `per_leaf` consecutive ones, every eight of those groups, and
/// so on, lie close together: splits across the longest side of the box, ties by index. Returns a
/// permutation of 0..n-1. n log n.
std::vector<std::uint32_t> compact_order(const std::vector<Eigen::Vector3d>& points,
                                         std::size_t per_leaf);

/// Bit i says whether value i is at most `limit`; no branches.
template <std::size_t N>
inline std::uint32_t at_most(const std::array<double, N>& values, double limit) {
    std::uint32_t mask = 0;
    for (std::size_t i = 0; i < N; ++i) {
        mask |= static_cast<std::uint32_t>(values[i] <= limit) << i;
    }
    return mask;
}

/// Boxes around groups of points, eight children a node, as structures of arrays, so that the
/// compiler makes vector code of the one loop that costs. Where F is convex, F(x) >= F(m) - sum_i
/// |grad F(m)'a_i| in a box of centre m and half-axes a_i: boxes where that is positive do not
/// reach into F <= 0. The boxes are turned along their points' principal axes, because a patch of
/// surface is flat, and a grown shape lies flat against many patches.
class BoxTree {
  public:
    BoxTree() = default;

    /// Leaf i encloses points[i * per_leaf, (i + 1) * per_leaf), the last what remains.
    BoxTree(std::span<const Eigen::Vector3d> points, std::size_t per_leaf);

    [[nodiscard]] std::size_t leaves() const { return leaves_; }

    /// Calls search.visit_leaf(i) for every leaf whose box reaches into F <= slack, where F and
    /// slack are search.form() and search.slack() at that moment: F may grow under way, when
    /// search.version() changes. Requires F convex.
    template <class Search>
    void visit(Search& search) const {
        if (leaves_ > 0) visit(search, levels_.size() - 1, 0);
    }

  private:
    static constexpr std::size_t kChildren = 8;

    // Boxes of up to eight children. half_axes[3 i + c] is component c of half-axis i.
    struct alignas(64) Node {
        std::array<double, kChildren> mx, my, mz;
        std::array<std::array<double, kChildren>, 9> half_axes;
    };

    static std::uint32_t reaching(const Node& node, const QuadraticForm& F, double slack);

    template <class Search>
    void visit(Search& search, std::size_t level, std::size_t index) const {
        const Node& node = levels_[level][index];
        const std::size_t below = level == 0 ? leaves_ : levels_[level - 1].size();
        const std::size_t first = index * kChildren;
        const std::size_t count = std::min(kChildren, below - first);
        std::uint32_t open =
            reaching(node, search.form(), search.slack()) & ((std::uint32_t{1} << count) - 1);
        while (open != 0) {
            const std::size_t child = first + static_cast<std::size_t>(std::countr_zero(open));
            open &= open - 1;
            const auto before = search.version();
            if (level == 0) {
                search.visit_leaf(child);
            } else {
                visit(search, level - 1, child);
            }
            if (search.version() != before) open &= reaching(node, search.form(), search.slack());
        }
    }

    std::size_t leaves_ = 0;
    std::vector<std::vector<Node>> levels_;  // [0] over leaves, each next over the one before
};

}  // namespace ellicast::sender
