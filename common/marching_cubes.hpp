// common/marching_cubes.hpp
#pragma once

#include <cstdint>
#include <span>

#include "common/solid_voxels.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// The surface between nodes with value < isolevel (inside) and the others, as a closed, outward
/// oriented 2-manifold whatever the values ([LC87], with the ambiguity rule and the triangulation
/// of DESIGN section 4: inside corners of a face are separated; no diagonal lies on a cube face).
/// Nodes on the border of the grid count as outside. Crossings lie at least 5 % of an edge away
/// from both nodes. Vertices are numbered in grid order; threads do not change the result. Empty
/// when nothing is inside. Requires values.size() == frame.size() (asserted), no NaN.
TriangleMesh marching_cubes(const GridFrame& frame, std::span<const float> values, float isolevel,
                            unsigned threads = 0);

}  // namespace ellicast::common
