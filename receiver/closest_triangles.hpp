// receiver/closest_triangles.hpp
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/morton_order.hpp"
#include "common/parallel.hpp"
#include "common/triangle_mesh.hpp"
#include "common/triangle_point.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::receiver {

/// Squared distance of x and a triangle.
inline double squared_distance_to(const common::TriangleMesh& mesh, std::uint32_t triangle,
                                  const Eigen::Vector3d& x) {
    const auto& [a, b, c] = mesh.triangles[triangle];
    const common::TrianglePoint hit = common::closest_point_on_triangle(
        x, mesh.positions[a], mesh.positions[b], mesh.positions[c]);
    return (x - hit.point).squaredNorm();
}

/// Calls visit(k, i, hit) once for each point i with its closest triangle, as
/// TriangleTree::closest() says, from up to `threads` threads (0: one per core) and in any order. k
/// is the point's place along a Morton curve, along which points are taken, so that what a search
/// reads of a large mesh is still at hand, and near(triangle, x), with the triangle of the point
/// before, gives the squared distance of some triangle as near to x as can be found quickly: that
/// bounds the search. Requires a triangle and finite points.
template <class Near, class Visit>
void visit_closest_triangles(const common::TriangleMesh& mesh,
                             const std::vector<Eigen::Vector3d>& points, unsigned threads,
                             const Near& near, const Visit& visit) {
    // More than what a squared distance loses by rounding.
    constexpr double kRounding = 1.0 + 1e-12;
    const common::TriangleTree tree(mesh);
    const std::vector<std::uint32_t> order = common::morton_order(points);
    common::parallel_for(order.size(), threads, [&](std::size_t begin, std::size_t end) {
        std::uint32_t last = 0;
        for (std::size_t k = begin; k < end; ++k) {
            const Eigen::Vector3d& x = points[order[k]];
            const common::TriangleTree::Hit hit = tree.closest(x, kRounding * near(last, x));
            last = hit.triangle;
            visit(k, order[k], hit);
        }
    });
}

}  // namespace ellicast::receiver
