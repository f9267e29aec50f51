// common/coarse_surface.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/distance_grid.hpp"
#include "common/ellipsoid.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// What the sender promised of the surface, without wire types.
struct PromisedTopology {
    std::size_t components = 1;
    std::int64_t euler_all = 2;
    std::int64_t euler_largest = 2;
};

struct CoarseSurface {
    TriangleMesh mesh;    // closed, outward 2-manifold; never empty
    double isolevel = 0;  // a length
    double cell = 0;      // spacing of the grid
    bool as_promised = false;
};

/// The mesh that the ellipsoids alone give ([BK02] section 2; DESIGN section 4, Topology): distance
/// grid of `cells` along the longest axis of `box`, then marching cubes at the isolevel whose
/// topology is the promised one, the field smoothed a little where that is needed for it. Among
/// several, the one nearest to the mean field value at the received `points`; among none, the one
/// that misses by least. Surplus components below 1 % of the volume are dropped, which the choice
/// of smoothing avoids where it can. Empty when no
/// isolevel gives a surface. Requires at least one ellipsoid. Threads do not change the result.
std::optional<CoarseSurface> make_coarse_surface(std::span<const Ellipsoid> ellipsoids,
                                                 std::span<const Eigen::Vector3d> points,
                                                 const Eigen::AlignedBox3d& box,
                                                 const PromisedTopology& promise, int cells,
                                                 unsigned threads);

}  // namespace ellicast::common
