// tests/support/rivals.hpp: other people's ways to a surface, to stand beside ours. Needs CGAL.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// CGAL's advancing front surface reconstruction ([CSD04]) with its default bounds. Positions are
/// those given, in their order; points left out of the surface stay as unreferenced vertices.
/// Orientation as it comes; the surface may have boundaries. Empty for points that span no volume.
common::TriangleMesh advancing_front(const std::vector<Eigen::Vector3d>& points);

/// How many positions some triangle has.
std::size_t positions_used(const common::TriangleMesh& mesh);

}  // namespace ellicast::tests
