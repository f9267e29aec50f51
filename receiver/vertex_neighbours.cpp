// receiver/vertex_neighbours.cpp
#include "receiver/vertex_neighbours.hpp"

namespace ellicast::receiver {

VertexNeighbours::VertexNeighbours(const common::TriangleMesh& mesh) {
    first_.assign(mesh.positions.size() + 1, 0);
    for (const common::Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) ++first_[v + 1];
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) first_[v + 1] += first_[v];
    vertices_.resize(3 * mesh.triangles.size());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const common::Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) vertices_[next[t[c]]++] = t[(c + 1) % 3];
    }
}

}  // namespace ellicast::receiver
