// receiver/vertex_insertion.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// A surface that is taking in points: for each vertex slot of `mesh` the point it stands for, or
/// kNone for a vertex of the marching-cubes mesh.
struct PointSurface {
    SurfaceMesh mesh;
    std::vector<std::uint32_t> point_of_vertex;
};

/// Projects each of `chosen` (indices into `points`) on the surface as it stands and inserts it
/// there: 1-to-3 split of the closest triangle, or a 2-to-4 split of an edge that it all but lies
/// on, then flips to Delaunay ([BK02] section 4.2). A projection that all but meets a
/// marching-cubes vertex takes that vertex over; one that all but meets an earlier point is left
/// out and returned. The new vertices stand at the projections: see shift_to_points. All closest
/// points are found first, on the surface at entry, on `threads` threads; then points go in along
/// the surface, each found by a short walk. Order of `chosen` does not matter; threads neither.
/// Requires that points are finite. Cost: about n log n for the search, constant per insertion.
std::vector<std::uint32_t> insert_points(PointSurface& surface,
                                         std::span<const Eigen::Vector3d> points,
                                         std::span<const std::uint32_t> chosen, unsigned threads);

/// Moves every vertex that stands for a point onto it. Faces may fold; flips mend that afterwards.
void shift_to_points(PointSurface& surface, std::span<const Eigen::Vector3d> points);

}  // namespace ellicast::receiver
