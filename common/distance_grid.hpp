// common/distance_grid.hpp
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/ellipsoid.hpp"
#include "common/solid_voxels.hpp"

namespace ellicast::common {

/// The spatial distance field of [BK02] section 2: at every node the least distance estimate over
/// all ellipsoids whose padded box holds the node, a length, negative inside, cut at -outside and
/// outside. Nodes far from all ellipsoids, and all nodes on the border of the grid, are `outside`.
struct DistanceGrid {
    GridFrame frame;
    float outside = 0;          // positive
    std::vector<float> values;  // frame.size()
};

/// Fills the grid. Boxes are padded by 3 spacings, so that values next to the surface are distances
/// on both sides of it. The least of a set: order and threads do not change a bit of the result.
/// Requires dims >= 2 on each axis (asserted). Cost: nodes in all padded boxes.
DistanceGrid make_distance_grid(std::span<const Ellipsoid> ellipsoids, const GridFrame& frame,
                                unsigned threads = 0);

/// The field with the binomial filter (share, 1 - 2 share, share) run along every axis: closes pits
/// and tunnels of a cell's size between ellipsoids, and rounds what is sharp. 0 <= share <= 1/4
/// (asserted). The border keeps its values. Threads do not change the result.
DistanceGrid smoothed(const DistanceGrid& grid, float share, unsigned threads = 0);

/// Trilinear value at x; `outside` beyond the grid.
double sample(const DistanceGrid& grid, const Eigen::Vector3d& x);

}  // namespace ellicast::common
