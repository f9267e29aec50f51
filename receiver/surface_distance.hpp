// receiver/surface_distance.hpp
#pragma once

#include <span>
#include <vector>

#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Length of the shortest path of edges from each vertex slot to the nearest of `sources`, as far
/// as `reach`; infinity beyond it and for dead slots. Requires live sources. About n log n in the
/// vertices reached.
std::vector<double> distance_along_edges(const SurfaceMesh& mesh, std::span<const VertexId> sources,
                                         double reach);

}  // namespace ellicast::receiver
