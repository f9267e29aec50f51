// common/triangle_point.hpp
#pragma once

#include <Eigen/Core>

namespace ellicast::common {

/// A point of triangle abc with its barycentric coordinates of a, b, c.
struct TrianglePoint {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
};

/// Closest point of triangle abc to x. Degenerate triangles are treated as the segment or point
/// they are. The point never leaves the bounding box of the corners, and where it lies on an edge,
/// both triangles of that edge get the same bits. Source: [E05] section 5.1.5, by projection and
/// then by edges. Constant time.
TrianglePoint closest_point_on_triangle(const Eigen::Vector3d& x, const Eigen::Vector3d& a,
                                        const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace ellicast::common
