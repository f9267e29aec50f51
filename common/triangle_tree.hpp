// common/triangle_tree.hpp
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "common/triangle_point.hpp"

namespace ellicast::common {

/// A bounding-volume tree over the triangles of a mesh, for exact closest-point queries. Built
/// once, deterministic, safe to query from many threads. Keeps its own copy of the corner
/// positions. Build O(n log n); a query about O(log n). Memory about 120 bytes a triangle.
class TriangleTree {
  public:
    TriangleTree() = default;
    explicit TriangleTree(const TriangleMesh& mesh);

    struct Hit {
        std::uint32_t triangle = std::numeric_limits<std::uint32_t>::max();  // index in the mesh
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
        double squared_distance = std::numeric_limits<double>::infinity();
    };
    /// Closest point of all triangles within `max_squared_distance`; ties go to the smallest
    /// triangle index. hit.triangle is the maximum value when there is none. Requires finite x.
    [[nodiscard]] Hit closest(
        const Eigen::Vector3d& x,
        double max_squared_distance = std::numeric_limits<double>::infinity()) const;

    [[nodiscard]] bool empty() const { return corners_.empty(); }

  private:
    struct Node {
        Eigen::Array4f low, high;  // of its box, rounded outwards; the last of four is 0
        std::uint32_t first = 0;   // leaf: first triangle slot; inner: right child
        std::uint32_t count = 0;   // 0: inner node, left child follows it
    };
    struct Builder;

    void test_leaf(const Node& leaf, const Eigen::Vector3d& x, Hit& best) const;

    std::vector<Node> nodes_;
    std::vector<std::array<Eigen::Vector3d, 3>> corners_;  // by slot
    std::vector<std::uint32_t> triangle_of_slot_;
};

}  // namespace ellicast::common
