// receiver/shrink_wrap.hpp
#pragma once

#include <Eigen/Core>
#include <span>

#include "common/triangle_mesh.hpp"

namespace ellicast::receiver {

/// Draws a closed mesh towards points near it, so that projecting them on it is nearly one-to-one
/// (DESIGN section 4: better error, and insertion 1.5-2 times faster). In each round every point
/// pulls the corners of its closest triangle by its offset, shared by barycentric weight; vertices
/// that no point pulls follow their neighbours; then a tangential smoothing step keeps the
/// triangles round. Closest triangles are searched once and followed from round to round by short
/// walks. Connectivity is untouched. Only the first eight points a vertex are asked, so that
/// prefixes of `points` should be even samples. Threads do not change the result. Requires a closed
/// oriented 2-manifold. Cost per
/// round: linear.
void shrink_wrap(common::TriangleMesh& mesh, std::span<const Eigen::Vector3d> points, int rounds,
                 unsigned threads);

}  // namespace ellicast::receiver
