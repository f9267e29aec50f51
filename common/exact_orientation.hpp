// common/exact_orientation.hpp
#pragma once

#include <Eigen/Core>

namespace ellicast::common {

/// Which side of the plane abc the point d lies on, exactly: the sign (-1, 0, 1) of det(a - d, b -
/// d, c - d), which is positive when a, b, c turn clockwise seen from d, and zero when the four are
/// coplanar. Source: [S97], the predicate orient3d with one filter and then expansion arithmetic.
/// Requires finite coordinates whose products of three neither overflow nor underflow (magnitudes
/// between 1e-90 and 1e90, or zero). About 15 ns, near zero some microseconds. Same input, same
/// sign.
int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d);

/// The same in the plane: the sign of det(a - c, b - c), positive when a, b, c turn
/// counter-clockwise.
int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

}  // namespace ellicast::common
