// sender/surface_smoothing.hpp
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// Positions after `steps` steps of Laplacian smoothing: every vertex goes half-way to the mean of
/// its neighbours, all at once. [BK02] section 4.1 smooths "in order to avoid ellipsoid growth
/// being restricted by the immediate neighbouring vertices". Vertices of no triangle stay where
/// they are. A neighbour counts once for every triangle that holds both, so in a closed mesh all
/// count alike. Cost: steps times triangles. Deterministic: sums run in index order.
std::vector<Eigen::Vector3d> smoothed_positions(const common::TriangleMesh& mesh, int steps);

/// Steps that suit a mesh of bounding-box diagonal 1: 3 for a dense scan, none for a coarse mesh,
/// where a step would eat what the ellipsoids should fill (DESIGN section 3).
int default_smoothing_steps(const common::TriangleMesh& mesh);

}  // namespace ellicast::sender
