// receiver/edge_flips.hpp
#pragma once

#include <cstddef>
#include <span>
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

/// What else a flip is judged by. The weights set it against length x angle.
struct FlipCriterion {
    /// Unit, per vertex slot; used with height_weight only.
    std::span<const Eigen::Vector3d> normals = {};
    /// Of how much nearer the new edge comes to the surface that the normals at the corners ask
    /// for (DESIGN section 7, "harmonic PN"), where those of both diagonals agree.
    double height_weight = 0;
    /// Of the angles opposite an edge, times the mean edge length: for meshes that were Delaunay.
    double delaunay_weight = 0;
};

/// Flips that lower the sum over all edges of length x (dihedral angle + 0.1 rad): few and gentle
/// creases, and short edges where the surface is flat. First single flips to a local minimum, then
/// pairs of neighbouring flips, each sweep over the mesh in slot order, at most `passes` times.
/// Never makes a triangle thinner than the thinner of those it replaces, unless it stays above
/// quality 0.02. Returns the number of flips.
std::size_t flip_to_smooth(SurfaceMesh& mesh, const FlipCriterion& criterion = {}, int passes = 8);

/// Quality of a triangle: 4 sqrt(3) area / sum of squared sides; 1 equilateral, 0 degenerate.
double triangle_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

}  // namespace ellicast::receiver
