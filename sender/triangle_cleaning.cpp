// sender/triangle_cleaning.cpp
#include "sender/triangle_cleaning.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sender/edge_table.hpp"
#include "sender/equal_positions.hpp"

namespace ellicast::sender {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

std::vector<bool> used_vertices(const std::vector<Triangle>& triangles, std::size_t vertices) {
    std::vector<bool> used(vertices, false);
    for (const Triangle& triangle : triangles) {
        for (const std::uint32_t v : triangle) {
            if (v >= vertices) throw std::invalid_argument("a face index is out of range");
            used[v] = true;
        }
    }
    return used;
}

// For every used vertex the first used one at the same position.
std::vector<std::uint32_t> first_at_position(const TriangleMesh& mesh,
                                             const std::vector<bool>& used) {
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        if (!used[v]) continue;
        // Cubes of lengths must stay finite too.
        if (!(mesh.positions[v].cwiseAbs().array() < 1e100).all()) {
            throw std::invalid_argument("a coordinate is not finite or beyond all measure");
        }
        vertices.push_back(v);
    }
    const std::vector<std::uint32_t> equal = first_equals(vertices.size(), [&](std::size_t k) {
        const Vector3d& p = mesh.positions[vertices[k]];
        return std::array<double, 3>{p.x(), p.y(), p.z()};
    });
    std::vector<std::uint32_t> first(used.size(), kNone);
    for (std::size_t k = 0; k < vertices.size(); ++k) first[vertices[k]] = vertices[equal[k]];
    return first;
}

void drop_marked(std::vector<Triangle>& triangles, const std::vector<bool>& drop) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (!drop[t]) triangles[kept++] = triangles[t];
    }
    triangles.resize(kept);
}

// The corners in ascending order, and whether that is an even permutation.
struct CornerSet {
    Triangle corners;
    bool even = true;
};

CornerSet corner_set(const Triangle& triangle) {
    CornerSet set{triangle, true};
    const auto order = [&](std::size_t a, std::size_t b) {
        if (set.corners[a] <= set.corners[b]) return;
        std::swap(set.corners[a], set.corners[b]);
        set.even = !set.even;
    };
    order(0, 1);
    order(1, 2);
    order(0, 1);
    return set;
}

// What is to become of the triangles with one set of corners.
struct Duplicates {
    std::vector<bool> drop;
    std::vector<bool> balanced;  // the one kept of as many facing one way as the other
};

Duplicates find_duplicates(const std::vector<Triangle>& triangles, std::size_t vertices) {
    Duplicates found{std::vector<bool>(triangles.size()), std::vector<bool>(triangles.size())};
    const auto corners = [&](std::uint32_t t) { return corner_set(triangles[t]).corners; };
    Buckets by_lowest(triangles.size(), vertices,
                      [&](std::size_t t) { return std::ranges::min(triangles[t]); });
    for (std::size_t v = 0; v < vertices; ++v) {
        std::span<std::uint32_t> rest = by_lowest.bucket(v);
        if (rest.size() < 2) continue;
        std::sort(rest.begin(), rest.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(corners(a), a) < std::pair(corners(b), b);
        });
        while (!rest.empty()) {
            std::size_t n = 1;
            while (n < rest.size() && corners(rest[n]) == corners(rest[0])) ++n;
            long excess = 0;
            for (const std::uint32_t t : rest.first(n)) {
                excess += corner_set(triangles[t]).even ? 1 : -1;
                found.drop[t] = n > 1;
            }
            const auto kept = std::find_if(rest.begin(), rest.end(), [&](std::uint32_t t) {
                return excess == 0 || corner_set(triangles[t]).even == (excess > 0);
            });
            found.drop[*kept] = false;
            found.balanced[*kept] = excess == 0;
            rest = rest.subspan(n);
        }
    }
    return found;
}

// Drops the balanced ones of every edge-connected part that has others too.
void cancel_inner_walls(std::vector<Triangle>& triangles, std::size_t vertices,
                        const std::vector<bool>& balanced) {
    DisjointSets parts(triangles.size());
    for_each_edge(triangles, vertices, [&](std::span<const HalfEdge> edge) {
        for (const HalfEdge h : edge) parts.join(triangle_of(edge[0]), triangle_of(h));
    });
    std::vector<bool> has_others(triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        if (!balanced[t]) has_others[parts.find(t)] = true;
    }
    std::vector<bool> drop(triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        drop[t] = balanced[t] && has_others[parts.find(t)];
    }
    drop_marked(triangles, drop);
}

void drop_duplicates(std::vector<Triangle>& triangles, std::size_t vertices) {
    Duplicates found = find_duplicates(triangles, vertices);
    std::vector<bool> balanced;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (!found.drop[t]) balanced.push_back(found.balanced[t]);
    }
    drop_marked(triangles, found.drop);
    if (std::find(balanced.begin(), balanced.end(), true) != balanced.end()) {
        cancel_inner_walls(triangles, vertices, balanced);
    }
}

// No more than what rounding makes of three points on a line.
bool has_no_area(const TriangleMesh& mesh, const Triangle& triangle) {
    const Vector3d a = mesh.positions[triangle[1]] - mesh.positions[triangle[0]];
    const Vector3d b = mesh.positions[triangle[2]] - mesh.positions[triangle[0]];
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
    return a.cross(b).norm() <= 1e-14 * longest;
}

void drop_loose_slivers(TriangleMesh& mesh) {
    std::vector<bool> drop(mesh.triangles.size());
    bool any = false;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        drop[t] = has_no_area(mesh, mesh.triangles[t]);
        any = any || drop[t];
    }
    if (!any) return;
    std::vector<bool> sealing(mesh.triangles.size(), true);
    for_each_edge(mesh.triangles, mesh.positions.size(), [&](std::span<const HalfEdge> edge) {
        if (edge.size() == 2) return;
        for (const HalfEdge h : edge) sealing[triangle_of(h)] = false;
    });
    for (std::size_t t = 0; t < drop.size(); ++t) drop[t] = drop[t] && !sealing[t];
    drop_marked(mesh.triangles, drop);
}

// Leaves out the positions that no triangle uses.
void compact(TriangleMesh& mesh) {
    const std::vector<bool> used = used_vertices(mesh.triangles, mesh.positions.size());
    std::vector<std::uint32_t> renamed(mesh.positions.size(), kNone);
    std::uint32_t count = 0;
    for (std::size_t v = 0; v < used.size(); ++v) {
        if (!used[v]) continue;
        mesh.positions[count] = mesh.positions[v];
        if (!mesh.colours.empty()) mesh.colours[count] = mesh.colours[v];
        renamed[v] = count++;
    }
    mesh.positions.resize(count);
    if (!mesh.colours.empty()) mesh.colours.resize(count);
    for (Triangle& triangle : mesh.triangles) {
        for (std::uint32_t& v : triangle) v = renamed[v];
    }
}

}  // namespace

CleanTriangles clean_triangles(TriangleMesh input) {
    CleanTriangles result;
    TriangleMesh& mesh = result.mesh;
    mesh = std::move(input);
    const std::size_t triangles = mesh.triangles.size();
    const std::vector<bool> used = used_vertices(mesh.triangles, mesh.positions.size());
    const std::vector<std::uint32_t> first = first_at_position(mesh, used);
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        if (!used[v]) ++result.unreferenced;
        if (used[v] && first[v] != v) ++result.merged;
    }
    std::vector<bool> drop(mesh.triangles.size());
    for (std::size_t t = 0; t < drop.size(); ++t) {
        auto& [a, b, c] = mesh.triangles[t];
        a = first[a];
        b = first[b];
        c = first[c];
        drop[t] = a == b || b == c || c == a;
    }
    drop_marked(mesh.triangles, drop);
    const std::size_t with_three_corners = mesh.triangles.size();
    drop_duplicates(mesh.triangles, mesh.positions.size());
    const std::size_t distinct = mesh.triangles.size();
    drop_loose_slivers(mesh);
    result.duplicate = with_three_corners - distinct;
    result.degenerate = triangles - with_three_corners + distinct - mesh.triangles.size();
    compact(mesh);
    return result;
}

}  // namespace ellicast::sender
