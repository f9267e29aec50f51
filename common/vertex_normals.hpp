// common/vertex_normals.hpp
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// What a triangle's corner with sides u and v, counterclockwise, adds to the normal there, by the
/// weight below.
inline Eigen::Vector3d corner_normal(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const double weight = u.squaredNorm() * v.squaredNorm();
    if (!(weight > 0.0)) return Eigen::Vector3d::Zero();
    return u.cross(v) / weight;
}

/// Unit normal at each position from the triangles around it, weighted by the sine of their angle
/// over the product of the two sides' lengths ([M99]: exact where the points lie on a sphere).
/// Zero where there is none. Linear.
std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh);

}  // namespace ellicast::common
