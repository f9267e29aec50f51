// common/half_edges.hpp
#pragma once

#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// A half-edge of a triangle under the key of its undirected edge.
struct HalfEdge {
    std::uint64_t key = 0;  // smaller vertex << 32 | larger vertex
    std::uint32_t face = 0;
    std::uint32_t corner = 0;  // 0..2: runs from this corner to the next

    /// From a vertex to itself, in a triangle with a repeated corner.
    [[nodiscard]] bool is_loop() const { return (key >> 32) == (key & 0xffffffffu); }
};

/// All of them by key, then face, then corner, so that those of an edge stand together, in an order
/// that the mesh alone decides. Requires indices in range (asserted). Cost: linear, and in each
/// vertex n log n of the edges to larger ones.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh);

/// Calls visit(first, last) for the half-edges of each edge, by key. `half_edges` must be sorted.
template <class Visit>
void for_each_edge(const std::vector<HalfEdge>& half_edges, const Visit& visit) {
    const HalfEdge* const end = half_edges.data() + half_edges.size();
    for (const HalfEdge* first = half_edges.data(); first != end;) {
        const HalfEdge* last = first;
        while (last != end && last->key == first->key) ++last;
        visit(first, last);
        first = last;
    }
}

}  // namespace ellicast::common
