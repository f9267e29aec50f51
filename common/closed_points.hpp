// common/closed_points.hpp
#pragma once

#include <Eigen/Core>
#include <span>

#include "common/distance_grid.hpp"

namespace ellicast::common {

/// Morphological closing, with balls of `radius`, of the solid where `grid` is below 0 together
/// with points on its surface and all that they enclose: what no ball reaches from the border of
/// the grid without meeting the solid or a point. Where ellipsoids are missing, points closer than
/// about `radius` times the square root of 2 hold the surface all the same, and gaps of less than
/// twice the radius are bridged. The values are lengths, negative inside, about 0 at the points;
/// distances are those between nodes, so that they are right to a cell. The border of the grid
/// counts as outside: leave it a margin of more than the radius around the points. Linear in the
/// nodes.
DistanceGrid closed_points(const DistanceGrid& grid, std::span<const Eigen::Vector3d> points,
                           double radius);

}  // namespace ellicast::common
