// receiver/vertex_removal.hpp
#pragma once

#include <cstddef>
#include <functional>

#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Removes vertices by half-edge collapses, each followed by Delaunay flips around the hole ([BK02]
/// section 4.2: "a simple mesh decimation scheme"). A vertex goes to the neighbour that leaves the
/// best worst triangle. What a collapse may do to triangles is bounded by quality and turn; the
/// bounds are relaxed pass by pass, so that easy vertices go first and no vertex is forced while a
/// gentle way is open. In the last pass only topology counts. `removable(v)` is asked once per
/// vertex slot. Topology never changes; a vertex that no legal collapse removes stays. Returns how
/// many are left of the removable ones. On `threads` threads (0: one per core), which do not change
/// the result. Cost: proportional to what is removed.
std::size_t remove_vertices(SurfaceMesh& mesh, const std::function<bool(VertexId)>& removable,
                            unsigned threads = 1);

}  // namespace ellicast::receiver
