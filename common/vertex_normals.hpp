// common/vertex_normals.hpp
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// Unit normal at each position from the triangles around it, weighted by the sine of their angle
/// over the product of the two sides' lengths ([M99]: exact where the points lie on a sphere).
/// Zero where there is none. Linear.
std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh);

}  // namespace ellicast::common
