// sender/surface_facets.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "sender/quadratic_form.hpp"

namespace ellicast::sender {

/// Indices of the triangles with an edge longer than `length`, ascending.
std::vector<std::uint32_t> large_triangles(const common::TriangleMesh& mesh, double length);

/// The chosen triangles, each moved outwards by the sagitta of the curved surface that it seems to
/// stand for: a triangle of a tessellated ball lies inside the ball, and an ellipsoid that fits the
/// ball would be locked by it ([BK02] Figure 4, left). Over an edge with turning angle theta and
/// triangle height w that is w / 2 tan(theta / 4), exact for strips such as a cylinder's, 0.4 of it
/// for equilateral triangles; the largest of the three counts, `largest` at most. Edges that turn
/// by more than 40 degrees are taken for creases, and concave ones do not count: flat faces of a
/// CAD model stay where they are. Requires a closed, outward mesh.
std::vector<Corners> offset_triangles(const common::TriangleMesh& mesh,
                                      const std::vector<std::uint32_t>& which, double largest);

}  // namespace ellicast::sender
