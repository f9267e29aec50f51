// receiver/edge_flips.hpp
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "receiver/mesh_regions.hpp"
#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Flips edges of the queue, and those that a flip makes doubtful, until all are Delaunay: the two
/// angles opposite an edge sum to at most 180 degrees ([BK02] section 4.2, "generalized Delaunay
/// criterion"). An edge stays when flipping it would fold the surface or turn a face by more than
/// about 60 degrees. `queue` is used up. Returns the number of flips; terminates, as each flip
/// lowers the Dirichlet energy.
std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue);

/// As above within a region of `regions`, while others are at work: an edge at one of whose four
/// corners two regions meet goes to `put_off` instead.
std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue,
                             const MeshRegions& regions, std::vector<HalfedgeId>& put_off);

/// As above with all edges in the queue, on `threads` threads (0: one per core), which do not
/// change the result.
std::size_t flip_all_to_delaunay(SurfaceMesh& mesh, unsigned threads = 0);

/// Half-edges next(h), prev(h), and those of h's twin.
std::array<HalfedgeId, 4> sides_of(const SurfaceMesh& mesh, HalfedgeId h);

/// Whether h, of an edge's two half-edges, speaks for it; false in dead faces.
inline bool stands_for_edge(const SurfaceMesh& mesh, HalfedgeId h) {
    return mesh.face_alive(SurfaceMesh::face_of(h)) && h < mesh.twin(h);
}

/// No region but one has faces at the four corners of h's two faces.
inline bool is_inner(const SurfaceMesh& mesh, const MeshRegions& regions, HalfedgeId h) {
    return regions.inner(SurfaceMesh::face_of(h)) &&
           regions.inner(SurfaceMesh::face_of(mesh.twin(h)));
}

/// Quality of a triangle: 4 sqrt(3) area / sum of squared sides; 1 equilateral, 0 degenerate.
double triangle_quality(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

}  // namespace ellicast::receiver
