// receiver/edge_flips.hpp
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "receiver/edge_constraints.hpp"
#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Flips edges of the queue, and those that a flip makes doubtful, until all are Delaunay: the two
/// angles opposite an edge sum to at most 180 degrees ([BK02] section 4.2, "generalized Delaunay
/// criterion"). An edge stays when flipping it would fold the surface or turn a face by more than
/// about 60 degrees. `queue` is used up. Returns the number of flips; terminates, as each flip
/// lowers the Dirichlet energy.
std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue);

/// As above with all edges in the queue. Which of them need a look is found on `threads` threads
/// (0: one per core), which do not change the result.
std::size_t flip_all_to_delaunay(SurfaceMesh& mesh, unsigned threads = 0);

/// What a flip is judged by beside creases; see common/diagonal_choice.hpp.
struct FlipCriterion {
    std::span<const Eigen::Vector3d> normals = {};  // unit, per vertex slot; or none at all
    common::DiagonalWeights weights = {};
    /// Per vertex slot: not 0 where the sender marked it. Empty: nowhere.
    std::span<const char> marks = {};
    /// Per vertex slot: not 0 where the ring must stay as it is. Empty: nowhere.
    std::span<const char> settled = {};
    /// Edges that stay.
    const FixedEdges* fixed = nullptr;
    bool pairs = true;     // flip two at a time as well
    unsigned threads = 0;  // 0: one per core; does not change the result
};

/// Flips that lower the sum over all edges of length x (dihedral angle + 0.1 rad): few and gentle
/// creases, and short edges where the surface is flat. First single flips to a local minimum, then
/// pairs of neighbouring flips. All edges are judged at once, on several threads; those that
/// promise a gain are then flipped in slot order, and so are those made doubtful by that, at most
/// `passes` times. Never makes a triangle thinner than the thinner of those it replaces, unless it
/// stays above quality 0.02. Returns the number of flips.
std::size_t flip_to_smooth(SurfaceMesh& mesh, const FlipCriterion& criterion = {}, int passes = 8);

/// Quality of a triangle: 4 sqrt(3) area / sum of squared sides; 1 equilateral, 0 degenerate.
double triangle_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

}  // namespace ellicast::receiver
