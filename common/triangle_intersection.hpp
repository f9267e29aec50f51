// common/triangle_intersection.hpp
#pragma once

#include <Eigen/Core>
#include <array>

namespace ellicast::common {

using TriangleCorners = std::array<Eigen::Vector3d, 3>;

/// Whether two closed triangles have a point in common; touching counts. Exact for whatever
/// triangles, those that are segments or points included, and the same for any order of corners and
/// triangles. Range of coordinates: see common/exact_orientation.hpp.
bool triangles_meet(const TriangleCorners& s, const TriangleCorners& t);

}  // namespace ellicast::common
