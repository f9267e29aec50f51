// receiver/vertex_neighbours.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::receiver {

/// The vertices that each vertex of a closed mesh shares an edge with, in the order of its
/// triangles; every edge is there once in each direction. Linear.
class VertexNeighbours {
  public:
    explicit VertexNeighbours(const common::TriangleMesh& mesh);

    [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t v) const {
        return {vertices_.data() + first_[v], first_[v + 1] - first_[v]};
    }

  private:
    std::vector<std::size_t> first_;  // those of v: first_[v] to first_[v + 1] in vertices_
    std::vector<std::uint32_t> vertices_;
};

}  // namespace ellicast::receiver
