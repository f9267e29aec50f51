// sender/ellipsoid_refinement.hpp
#pragma once

#include <span>
#include <vector>

#include "common/ellipsoid.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

struct RefinementOptions {
    int rounds = 20;         // 0 changes nothing
    double loss = 0.1;       // p: probability that an ellipsoid does not arrive
    int grid = 96;           // cells along the longest axis; the receiver's default
    double isolevel = 0.25;  // in cells: where the receiver prefers to put the surface
    unsigned threads = 0;    // does not change the result
};

/// Moves and reshapes the chosen ellipsoids, all nine scalars of each, so that the surface a
/// receiver makes of them (the isosurface of the least distance estimate, [BK02] section 2) comes
/// nearest to the solid's. Goes beyond the paper, whose ellipsoids stay as they grew, inside the
/// solid. Least in the volume between the surfaces, expected over the loss of single ellipsoids to
/// second order: where ellipsoid i has the least distance, it pulls with weight 1, and the second
/// with weight p, since it bears the surface when i is lost. Pits and bulges of more than half a
/// cell weigh more, for they become tunnels.
/// Returns as many ellipsoids, in the same order; centres stay within the solid's box, and no
/// ellipsoid becomes thinner than 0.2 cells. `solid` is closed and outward oriented. Frame and unit
/// are the caller's. Cost: rounds x shells of the ellipsoids in cells, about 20 ms a round for 400
/// of horse. Threads do not change a bit of the result.
std::vector<common::Ellipsoid> refine_ellipsoids(std::span<const common::Ellipsoid> chosen,
                                                 const common::TriangleMesh& solid,
                                                 const RefinementOptions& options);

}  // namespace ellicast::sender
