// tests/receiver/edge_constraints_test.cpp
#include "receiver/edge_constraints.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "common/random.hpp"
#include "receiver/edge_flips.hpp"
#include "receiver/surface_smoothing.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Edge = std::pair<VertexId, VertexId>;

SurfaceMesh surface(const common::TriangleMesh& mesh) {
    std::optional<SurfaceMesh> result = SurfaceMesh::from(mesh);
    REQUIRE(result);
    return std::move(*result);
}

std::vector<Edge> edges_of(const SurfaceMesh& mesh) {
    std::set<Edge> edges;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        if (!mesh.face_alive(SurfaceMesh::face_of(h))) continue;
        const auto [a, b] = std::minmax({mesh.from_vertex(h), mesh.to_vertex(h)});
        edges.emplace(a, b);
    }
    return {edges.begin(), edges.end()};
}

// Flips whose quads are convex seen along their normal and nearly flat, so that the mesh stays one
// without folds.
std::size_t flip_at_random(SurfaceMesh& mesh, common::Random& random, std::size_t attempts) {
    std::size_t flips = 0;
    for (std::size_t n = 0; n < attempts; ++n) {
        const auto h = static_cast<HalfedgeId>(random.below(3 * mesh.face_slots()));
        if (!mesh.can_flip(h)) continue;
        const HalfedgeId t = mesh.twin(h);
        const FaceId f = SurfaceMesh::face_of(h);
        const FaceId g = SurfaceMesh::face_of(t);
        const Eigen::Vector3d up = (mesh.area_normal(f) + mesh.area_normal(g)).normalized();
        mesh.flip(h);
        const bool folds = mesh.area_normal(f).normalized().dot(up) < 0.5 ||
                           mesh.area_normal(g).normalized().dot(up) < 0.5;
        if (folds) {
            mesh.flip(h);
        } else {
            ++flips;
        }
    }
    return flips;
}

}  // namespace

TEST_CASE("edges that flips took away are brought back, and stay") {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        CAPTURE(seed);
        SurfaceMesh mesh =
            surface(seed % 2 == 0 ? tests::icosphere(3) : tests::torus(3, 1, 40, 20));
        const std::vector<Edge> original = edges_of(mesh);
        common::Random random(seed);
        REQUIRE(flip_at_random(mesh, random, 4 * mesh.face_slots()) > original.size() / 4);
        const auto missing = [&](const Edge& edge) {
            return !mesh.adjacent(edge.first, edge.second);
        };
        const auto lost = std::count_if(original.begin(), original.end(), missing);
        REQUIRE(lost > static_cast<std::ptrdiff_t>(original.size() / 8));

        FixedEdges fixed(mesh.vertex_slots());
        std::size_t failed = 0;
        for (const auto& [a, b] : original) {
            if (insert_edge(mesh, a, b, fixed)) {
                REQUIRE(mesh.adjacent(a, b));
                fixed.add(a, b);
            } else {
                ++failed;
            }
        }
        REQUIRE(mesh.validate() == "");
        // No two edges of a triangulation cross, so nothing may stand in the way for long.
        CHECK(failed <= original.size() / 100);
        const auto left = std::count_if(original.begin(), original.end(), missing);
        CHECK(left <= static_cast<std::ptrdiff_t>(failed));  // later flips may have made one
    }
}

TEST_CASE("one edge far away is inserted through all that cross it") {
    SurfaceMesh mesh = surface(tests::box({2, 2, 1}, 8));
    // Along the top, from one side to the other, past the grid's vertices.
    const auto at = [&](double x, double y) {
        VertexId found = kNone;
        for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
            const Eigen::Vector3d& p = mesh.position(v);
            if ((p - Eigen::Vector3d(x, y, 0.5)).norm() < 1e-9) found = v;
        }
        REQUIRE(found != kNone);
        return found;
    };
    const VertexId a = at(-0.75, -0.25);
    const VertexId b = at(0.75, 0.0);
    REQUIRE_FALSE(mesh.adjacent(a, b));
    FixedEdges fixed(mesh.vertex_slots());
    REQUIRE(insert_edge(mesh, a, b, fixed));
    CHECK(mesh.adjacent(a, b));
    CHECK(mesh.validate() == "");
    for (FaceId f = 0; f < mesh.face_slots(); ++f) {
        const auto corners = mesh.face(f);
        const bool on_top = std::all_of(corners.begin(), corners.end(), [&](VertexId v) {
            return mesh.position(v).z() > 0.5 - 1e-9;
        });
        if (on_top) REQUIRE(mesh.area_normal(f).z() > 0.0);  // no fold
    }
}

TEST_CASE("a vertex on the line, a fixed edge across it or the far side is in the way") {
    SurfaceMesh mesh = surface(tests::box({2, 2, 1}, 8));
    const auto nearest = [&](double x, double y, double z) {
        VertexId best = 0;
        for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
            const Eigen::Vector3d p(x, y, z);
            if ((mesh.position(v) - p).norm() < (mesh.position(best) - p).norm()) best = v;
        }
        return best;
    };
    FixedEdges fixed(mesh.vertex_slots());
    CHECK_FALSE(insert_edge(mesh, nearest(-0.75, 0, 0.5), nearest(0.75, 0, 0.5), fixed));
    CHECK_FALSE(insert_edge(mesh, nearest(0, 0, 0.5), nearest(0.25, 0.25, -0.5), fixed));
    CHECK(mesh.validate() == "");
    const VertexId a = nearest(-0.5, -0.25, 0.5);
    const VertexId b = nearest(0.5, 0.0, 0.5);
    REQUIRE(insert_edge(mesh, a, b, fixed));
    fixed.add(a, b);
    const VertexId c = nearest(0.0, -0.5, 0.5);
    const VertexId d = nearest(-0.25, 0.5, 0.5);
    CHECK_FALSE(insert_edge(mesh, c, d, fixed));
    CHECK(mesh.adjacent(a, b));
    CHECK(mesh.validate() == "");
}

TEST_CASE("whatever edges are asked for, the mesh stays a closed manifold of its topology") {
    SurfaceMesh mesh = surface(tests::torus(3, 1, 30, 15));
    common::Random random(3);
    FixedEdges fixed(mesh.vertex_slots());
    for (int n = 0; n < 3000; ++n) {
        const auto a = static_cast<VertexId>(random.below(mesh.vertex_slots()));
        const auto b = static_cast<VertexId>(random.below(mesh.vertex_slots()));
        if (a == b) continue;
        if (insert_edge(mesh, a, b, fixed)) fixed.add(a, b);
    }
    CHECK(mesh.validate() == "");
    CHECK(fixed.size() > 0);
}

TEST_CASE("smoothing flips leave fixed edges alone") {
    SurfaceMesh mesh = surface(tests::icosphere(3));
    common::Random random(9);
    flip_at_random(mesh, random, 400);
    SurfaceMesh free = mesh;
    FixedEdges fixed(mesh.vertex_slots());
    const std::vector<Edge> edges = edges_of(mesh);
    for (std::size_t k = 0; k < edges.size(); k += 5) fixed.add(edges[k].first, edges[k].second);
    flip_to_smooth(mesh, {.fixed = &fixed});
    flip_to_smooth(free);
    std::size_t gone = 0;
    for (std::size_t k = 0; k < edges.size(); k += 5) {
        CHECK(mesh.adjacent(edges[k].first, edges[k].second));
        gone += free.adjacent(edges[k].first, edges[k].second) ? 0 : 1;
    }
    CHECK(gone > 5);  // or it would have been no test
}

TEST_CASE("fixed edges have no direction and are found only where they were added") {
    FixedEdges fixed(10);
    CHECK_FALSE(fixed.contains(1, 2));
    fixed.add(2, 1);
    fixed.add(1, 2);
    fixed.add(1, 3);
    CHECK(fixed.size() == 2);
    CHECK(fixed.contains(1, 2));
    CHECK(fixed.contains(2, 1));
    CHECK_FALSE(fixed.contains(2, 3));
    CHECK_FALSE(FixedEdges{}.contains(1, 2));
}

}  // namespace ellicast::receiver
