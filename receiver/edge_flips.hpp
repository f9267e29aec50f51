// receiver/edge_flips.hpp
#pragma once

#include <cstddef>
#include <vector>

#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Flips edges of the queue, and those that a flip makes doubtful, until all are Delaunay: the two
/// angles opposite an edge sum to at most 180 degrees ([BK02] section 4.2, "generalized Delaunay
/// criterion"). An edge stays when flipping it would fold the surface or turn a face by more than
/// about 60 degrees. `queue` is used up. Returns the number of flips; terminates, as each flip
/// lowers the Dirichlet energy.
std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue);

/// As above with all edges in the queue.
std::size_t flip_all_to_delaunay(SurfaceMesh& mesh);

struct SmoothingFlips {
    /// An edge is flipped when that lowers the sum of length x dihedral angle over the five edges
    /// of its two faces by more than this many radians times the mean edge length. About 0.3 where
    /// nothing is missing, for less undoes what the original had; towards 0 under loss (DESIGN
    /// section 4).
    double min_gain = 0.3;
    int passes = 8;
};

/// Flips that minimise length x dihedral angle, over the whole mesh in slot order, pass by pass
/// until none is left. Never makes a triangle thinner than both it replaces and kThinnest. Returns
/// the number of flips.
std::size_t flip_to_smooth(SurfaceMesh& mesh, const SmoothingFlips& options);

/// Quality of a triangle: 4 sqrt(3) area / sum of squared sides; 1 equilateral, 0 degenerate.
double triangle_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

}  // namespace ellicast::receiver
