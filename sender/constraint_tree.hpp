// sender/constraint_tree.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sender/constraint_search.hpp"

namespace ellicast::sender {

/// The search by a tree: exactly what a scan over all points gives.
///
/// A flat tree with eight children a node and sixteen points a leaf, both as structures of arrays,
/// so that the compiler makes vector code of the two loops that cost. At the best t so far F = F0 +
/// t F1 is convex, hence F(x) >= F(m) - sum_i |grad F(m)'a_i| in a box of centre m and half-axes
/// a_i, and boxes where that is positive hold nothing better. The boxes are turned along their
/// points' principal axes: a patch of surface is flat, and a grown shape lies flat against many
/// patches. Immutable once built; safe to ask from many threads. Memory about 70 bytes a point;
/// build O(n log n); a query about O(log n).
class ConstraintTree final : public ConstraintSearch {
  public:
    /// Requires finite points, fewer than 2^32 (asserted).
    explicit ConstraintTree(std::vector<Eigen::Vector3d> points);

    /// A tree over other positions of the same points, with the leaves of `like`: built in linear
    /// time, and as good when the points have moved little. Requires as many points (asserted).
    ConstraintTree(std::vector<Eigen::Vector3d> points, const ConstraintTree& like);

    [[nodiscard]] std::optional<Contact> first_contact(
        const QuadraticForm& F0, const QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> guesses = {}) const override;

    [[nodiscard]] const std::vector<Eigen::Vector3d>& points() const override { return points_; }

  private:
    static constexpr std::size_t kChildren = 8;
    static constexpr std::size_t kLeafPoints = 16;

    struct alignas(64) Leaf {
        std::array<double, kLeafPoints> x, y, z;  // the last point repeats when fewer
    };
    // Boxes of up to eight children. half_axes[3 i + c] is component c of half-axis i.
    struct alignas(64) Node {
        std::array<double, kChildren> mx, my, mz;
        std::array<std::array<double, kChildren>, 9> half_axes;
    };
    class Query;

    void sort_into_leaves();
    void fill_leaves();
    void build_nodes();

    std::vector<Eigen::Vector3d> points_;  // as given
    std::vector<std::uint32_t> order_;     // index of the point in each slot; slot / 16 is its leaf
    std::vector<Leaf> leaves_;
    std::vector<std::vector<Node>> levels_;  // [0] over leaves, each next over the one before
    double extent_ = 0;                      // largest absolute coordinate
};

}  // namespace ellicast::sender
