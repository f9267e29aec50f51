// sender/constraint_tree.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sender/box_tree.hpp"
#include "sender/constraint_search.hpp"

namespace ellicast::sender {

/// What growth may not run through. Constraints are numbered: points first, then triangles.
struct Constraints {
    std::vector<Eigen::Vector3d> points;
    std::vector<Corners> triangles;

    [[nodiscard]] std::size_t size() const { return points.size() + triangles.size(); }
};

/// The search by trees: what a scan over all constraints gives, to the bit.
/// Immutable once built; safe to ask from many threads. Memory about 130 bytes a point, 300 a
/// triangle; build O(n log n); a query about O(log n).
class ConstraintTree final : public ConstraintSearch {
  public:
    /// Requires finite coordinates, fewer than 2^32 constraints (asserted).
    explicit ConstraintTree(Constraints constraints);

    /// The same constraints at other positions, in the order of `like`: built in linear time, and
    /// as good when they have moved little. Requires the same numbers of them (asserted).
    ConstraintTree(Constraints constraints, const ConstraintTree& like);

    [[nodiscard]] std::optional<Contact> first_contact(
        const QuadraticForm& F0, const QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> guesses = {}) const override;

    [[nodiscard]] const Constraints& constraints() const { return constraints_; }

  private:
    static constexpr std::size_t kLeafPoints = 16;  // 6 cache lines
    static constexpr std::size_t kLeafTriangles = 1;

    struct alignas(64) Leaf {
        std::array<double, kLeafPoints> x, y, z;  // the last point repeats when fewer
    };
    class Query;
    class PointQuery;
    class TriangleQuery;

    void order_constraints();
    void build();

    Constraints constraints_;
    std::vector<std::uint32_t>
        point_order_;  // number of the point in each slot; slot / 16 is its leaf
    std::vector<std::uint32_t> triangle_order_;
    std::vector<Leaf> leaves_;
    BoxTree point_boxes_, triangle_boxes_;
    double extent_ = 0;  // largest absolute coordinate
};

}  // namespace ellicast::sender
