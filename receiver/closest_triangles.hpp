// receiver/closest_triangles.hpp
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::receiver {

/// Calls visit(i, hit) once for each point with its closest triangle, as TriangleTree::closest()
/// says, from up to `threads` threads (0: one per core) and in any order. Points are taken
/// along a Morton curve: the triangle of one bounds the search for the next, and what a search
/// reads of a large mesh is still at hand. Requires a triangle and finite points.
void visit_closest_triangles(
    const common::TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& points, unsigned threads,
    const std::function<void(std::size_t i, const common::TriangleTree::Hit& hit)>& visit);

}  // namespace ellicast::receiver
