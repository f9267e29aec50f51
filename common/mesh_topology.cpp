// common/mesh_topology.cpp
#include "common/mesh_topology.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <mutex>
#include <numeric>

#include "common/parallel.hpp"
#include "common/triangle_intersection.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// A half-edge of a triangle under the key of its undirected edge. Sorting by key brings the
// triangles of an edge together, in an order that the mesh alone decides.
struct HalfEdge {
    std::uint64_t key = 0;  // smaller vertex << 32 | larger vertex
    std::uint32_t face = 0;
    std::uint32_t corner = 0;  // 0..2: runs from this corner to the next

    [[nodiscard]] bool is_loop() const { return (key >> 32) == (key & 0xffffffffu); }
};

std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
    std::vector<HalfEdge> half_edges;
    half_edges.reserve(3 * mesh.triangles.size());
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        const Triangle& t = mesh.triangles[f];
        for (std::uint32_t c = 0; c < 3; ++c) {
            assert(t[c] < mesh.positions.size());
            const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
            half_edges.push_back(
                {std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(f), c});
        }
    }
    std::sort(half_edges.begin(), half_edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
        if (a.key != b.key) return a.key < b.key;
        return a.face != b.face ? a.face < b.face : a.corner < b.corner;
    });
    return half_edges;
}

// Calls visit(first, last) for the half-edges of each edge.
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

TriangleCorners corners_of(const TriangleMesh& mesh, const Triangle& t) {
    return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
}

Eigen::AlignedBox3d box_of(const TriangleCorners& corners) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : corners) box.extend(p);
    return box;
}

bool share_vertex(const Triangle& s, const Triangle& t) {
    return std::any_of(s.begin(), s.end(), [&](std::uint32_t v) {
        return std::find(t.begin(), t.end(), v) != t.end();
    });
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
    if (components.count > 0) {
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

namespace {

struct Marked {
    std::size_t pairs = 0;
    std::vector<std::uint8_t> faces;  // 1: in a pair
};

/// Pairs with at least one of `suspects`, which are ascending; each once.
Marked mark_self_intersections(const TriangleMesh& mesh, std::span<const std::uint32_t> suspects,
                               unsigned threads) {
    const TriangleTree tree(mesh);
    std::vector<std::uint8_t> suspected(mesh.triangles.size(), 0);
    for (const std::uint32_t f : suspects) suspected[f] = 1;
    Marked result;
    result.faces.assign(mesh.triangles.size(), 0);
    std::mutex merging;
    parallel_for(suspects.size(), threads, [&](std::size_t begin, std::size_t end) {
        std::size_t pairs = 0;
        std::vector<std::uint32_t> found;
        std::vector<std::uint32_t> candidates;
        for (const std::uint32_t f : suspects.subspan(begin, end - begin)) {
            const Triangle& t = mesh.triangles[f];
            const TriangleCorners corners = corners_of(mesh, t);
            tree.find_meeting(box_of(corners), candidates);
            for (const std::uint32_t other : candidates) {
                const bool counted_there = suspected[other] != 0 && other <= f;
                if (counted_there || share_vertex(t, mesh.triangles[other])) continue;
                if (!triangles_meet(corners, corners_of(mesh, mesh.triangles[other]))) continue;
                ++pairs;
                found.push_back(f);
                found.push_back(other);
            }
        }
        // Sums and unions: the order of the threads does not show.
        const std::lock_guard lock(merging);
        result.pairs += pairs;
        for (const std::uint32_t f : found) result.faces[f] = 1;
    });
    return result;
}

std::vector<std::uint32_t> all_faces(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> faces(mesh.triangles.size());
    std::iota(faces.begin(), faces.end(), 0u);
    return faces;
}

}  // namespace

SelfIntersections count_self_intersections(const TriangleMesh& mesh, unsigned threads) {
    const Marked marked = mark_self_intersections(mesh, all_faces(mesh), threads);
    return {marked.pairs, static_cast<std::size_t>(std::count(
                              marked.faces.begin(), marked.faces.end(), std::uint8_t{1}))};
}

std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh,
                                                   std::span<const std::uint32_t> suspects,
                                                   unsigned threads) {
    const Marked marked = mark_self_intersections(mesh, suspects, threads);
    std::vector<std::uint32_t> faces;
    for (std::uint32_t f = 0; f < marked.faces.size(); ++f) {
        if (marked.faces[f] != 0) faces.push_back(f);
    }
    return faces;
}

std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh, unsigned threads) {
    return self_intersecting_faces(mesh, all_faces(mesh), threads);
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
