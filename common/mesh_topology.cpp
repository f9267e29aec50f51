// common/mesh_topology.cpp
#include "common/mesh_topology.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "common/half_edges.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// Disjoint sets with path halving; the root is always the smallest member.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
    }

    std::uint32_t root(std::uint32_t i) {
        while (parent_[i] != i) {
            parent_[i] = parent_[parent_[i]];
            i = parent_[i];
        }
        return i;
    }

    void unite(std::uint32_t i, std::uint32_t j) {
        i = root(i);
        j = root(j);
        if (i != j) parent_[std::max(i, j)] = std::min(i, j);
    }

  private:
    std::vector<std::uint32_t> parent_;
};

struct Components {
    std::vector<std::uint32_t> of_face;
    std::size_t count = 0;
};

Components find_components(const std::vector<HalfEdge>& half_edges, std::size_t faces) {
    DisjointSets sets(faces);
    for_each_edge(half_edges, [&](const HalfEdge* first, const HalfEdge* last) {
        for (const HalfEdge* h = first + 1; h < last; ++h) sets.unite(first->face, h->face);
    });
    // Roots are the smallest faces, so a root is numbered before any other face of its set.
    Components components;
    components.of_face.resize(faces);
    for (std::uint32_t f = 0; f < faces; ++f) {
        const std::uint32_t root = sets.root(f);
        components.of_face[f] =
            root == f ? static_cast<std::uint32_t>(components.count++) : components.of_face[root];
    }
    return components;
}

// Whether the edge has two triangles that run along it in opposite directions, as on an oriented
// manifold.
bool is_oriented_pair(const TriangleMesh& mesh, const HalfEdge* first, const HalfEdge* last) {
    return last - first == 2 && mesh.triangles[first[0].face][first[0].corner] !=
                                    mesh.triangles[first[1].face][first[1].corner];
}

// Counts vertices whose triangles form more than one fan. A fan is a chain of triangles, each
// joined to the next by an edge that these two alone have: at an edge of three or more triangles a
// fan ends, for nothing tells which of them follow each other.
std::size_t count_non_manifold_vertices(const TriangleMesh& mesh,
                                        const std::vector<HalfEdge>& half_edges) {
    DisjointSets corners(3 * mesh.triangles.size());
    const auto corner_at = [&](const HalfEdge& h, std::uint32_t vertex) {
        const std::uint32_t from = mesh.triangles[h.face][h.corner];
        return 3 * h.face + (from == vertex ? h.corner : (h.corner + 1) % 3);
    };
    for_each_edge(half_edges, [&](const HalfEdge* first, const HalfEdge* last) {
        if (last - first != 2 || first->is_loop()) return;
        for (const std::uint64_t vertex : {first->key >> 32, first->key & 0xffffffffu}) {
            const auto v = static_cast<std::uint32_t>(vertex);
            corners.unite(corner_at(first[0], v), corner_at(first[1], v));
        }
    });
    std::vector<std::uint32_t> fans(mesh.positions.size(), 0);
    for (std::uint32_t c = 0; c < 3 * mesh.triangles.size(); ++c) {
        if (corners.root(c) == c) ++fans[mesh.triangles[c / 3][c % 3]];
    }
    return static_cast<std::size_t>(
        std::count_if(fans.begin(), fans.end(), [](std::uint32_t n) { return n > 1; }));
}

// Six times the signed volume between the origin `o` and a triangle.
double six_volume(const TriangleMesh& mesh, const Triangle& t, const Vector3d& o) {
    const Vector3d a = mesh.positions[t[0]] - o;
    const Vector3d b = mesh.positions[t[1]] - o;
    const Vector3d c = mesh.positions[t[2]] - o;
    return a.dot(b.cross(c));
}

// The component with the largest |volume|, ties to the first.
std::uint32_t largest_component(const TriangleMesh& mesh, const Components& components) {
    const Vector3d center = surface_box(mesh).center();
    std::vector<double> volumes(components.count, 0.0);
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        volumes[components.of_face[f]] += six_volume(mesh, mesh.triangles[f], center);
    }
    std::size_t largest = 0;
    for (std::size_t i = 1; i < volumes.size(); ++i) {
        if (std::abs(volumes[i]) > std::abs(volumes[largest])) largest = i;
    }
    return static_cast<std::uint32_t>(largest);
}

// V - E + F of the faces for which belongs(face) holds; a loop counts as an edge.
template <class Belongs>
std::int64_t euler_of(const TriangleMesh& mesh, const std::vector<HalfEdge>& half_edges,
                      const Belongs& belongs) {
    std::vector<std::uint8_t> used(mesh.positions.size(), 0);
    std::int64_t euler = 0;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        if (!belongs(f)) continue;
        ++euler;
        for (const std::uint32_t corner : mesh.triangles[f]) used[corner] = 1;
    }
    for_each_edge(half_edges, [&](const HalfEdge* first, const HalfEdge*) {
        if (belongs(first->face)) --euler;
    });
    return euler + std::count(used.begin(), used.end(), std::uint8_t{1});
}

}  // namespace

MeshTopology analyse_topology(const TriangleMesh& mesh) {
    MeshTopology result;
    result.faces = mesh.triangles.size();
    const std::vector<HalfEdge> half_edges = sorted_half_edges(mesh);
    for_each_edge(half_edges, [&](const HalfEdge* first, const HalfEdge* last) {
        ++result.edges;
        if (first->is_loop()) {
            ++result.non_manifold_edges;  // from a triangle with a repeated corner
        } else if (last - first == 1) {
            ++result.boundary_edges;
        } else if (!is_oriented_pair(mesh, first, last)) {
            ++result.non_manifold_edges;
        }
    });
    result.non_manifold_vertices = count_non_manifold_vertices(mesh, half_edges);
    result.euler = euler_of(mesh, half_edges, [](std::size_t) { return true; });
    // V from V - E + F.
    result.vertices =
        static_cast<std::size_t>(result.euler + static_cast<std::int64_t>(result.edges) -
                                 static_cast<std::int64_t>(result.faces));
    const Components components = find_components(half_edges, mesh.triangles.size());
    result.components = components.count;
    if (components.count == 1) {
        result.euler_largest = result.euler;
    } else if (components.count > 0) {
        const std::uint32_t largest = largest_component(mesh, components);
        result.euler_largest = euler_of(
            mesh, half_edges, [&](std::size_t f) { return components.of_face[f] == largest; });
    }
    result.closed = result.faces > 0 && result.boundary_edges == 0;
    result.manifold = result.non_manifold_edges == 0 && result.non_manifold_vertices == 0;
    return result;
}

std::vector<std::uint32_t> triangle_components(const TriangleMesh& mesh) {
    return find_components(sorted_half_edges(mesh), mesh.triangles.size()).of_face;
}

Eigen::AlignedBox3d surface_box(const TriangleMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t corner : t) box.extend(mesh.positions[corner]);
    }
    return box;
}

double signed_volume(const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) return 0.0;
    // About the middle of the box: far from the origin the terms would cancel badly.
    const Vector3d center = surface_box(mesh).center();
    double sum = 0.0;
    for (const Triangle& t : mesh.triangles) sum += six_volume(mesh, t, center);
    return sum / 6.0;
}

}  // namespace ellicast::common
