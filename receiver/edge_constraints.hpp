// receiver/edge_constraints.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Edges that must stay: pairs of vertex slots. Asking is cheap where no such edge ends.
class FixedEdges {
  public:
    /// None at all.
    FixedEdges() = default;
    explicit FixedEdges(std::size_t vertex_slots) : ends_(vertex_slots, 0) {}

    void add(VertexId a, VertexId b);
    [[nodiscard]] bool contains(VertexId a, VertexId b) const;
    [[nodiscard]] std::size_t size() const { return edges_.size(); }

  private:
    std::vector<char> ends_;                   // per vertex slot: 1 where an edge ends
    std::unordered_set<std::uint64_t> edges_;  // smaller slot << 32 | greater
};

/// Flips edges until a and b are neighbours: those that cross the line from a to b, seen along the
/// normal there, in the way of constrained Delaunay triangulations [S93]. False, with some edges
/// flipped, where the surface folds over itself between the two, where a vertex lies on the line, a
/// fixed edge crosses it, or more than 64 do. Cost: quadratic in the edges that cross.
bool insert_edge(SurfaceMesh& mesh, VertexId a, VertexId b, const FixedEdges& fixed);

}  // namespace ellicast::receiver
