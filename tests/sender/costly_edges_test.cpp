// tests/sender/costly_edges_test.cpp
#include "sender/costly_edges.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "sender/surface_decimation.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Edge = std::array<std::uint32_t, 2>;
using protocol::EdgeRecord;

std::set<Edge> edges_of(const TriangleMesh& mesh) {
    std::set<Edge> edges;
    for (const common::Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) {
            const auto [a, b] = std::minmax(t[c], t[(c + 1) % 3]);
            edges.insert({a, b});
        }
    }
    return edges;
}

std::uint32_t size_of(const TriangleMesh& mesh) {
    return static_cast<std::uint32_t>(mesh.positions.size());
}

// A prism whose lids are fans from one corner: long edges that no criterion of shape would choose.
TriangleMesh fan_lidded_drum(std::uint32_t around, std::uint32_t rings) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < rings; ++i) {
        for (std::uint32_t k = 0; k < around; ++k) {
            const double angle = 6.283185307179586 * k / around;
            // Bent lids, so that it matters how they are triangulated.
            const bool lid = i == 0 || i + 1 == rings;
            const double bend = lid ? 0.3 * std::cos(2 * angle) : 0.0;
            mesh.positions.emplace_back(std::cos(angle), std::sin(angle),
                                        4.0 * i / rings + (i == 0 ? -bend : bend));
        }
    }
    for (std::uint32_t i = 0; i + 1 < rings; ++i) {
        for (std::uint32_t k = 0; k < around; ++k) {
            const std::uint32_t a = i * around + k;
            const std::uint32_t b = i * around + (k + 1) % around;
            mesh.triangles.push_back({a, b, b + around});
            mesh.triangles.push_back({a, b + around, a + around});
        }
    }
    const std::uint32_t top = (rings - 1) * around;
    for (std::uint32_t k = 1; k + 1 < around; ++k) {
        mesh.triangles.push_back({0, k + 1, k});
        mesh.triangles.push_back({top, top + k, top + k + 1});
    }
    return mesh;
}

}  // namespace

TEST_CASE("the edges told are the surface's own, the costliest first, and not too many") {
    const TriangleMesh mesh = fan_lidded_drum(60, 60);
    const std::uint32_t vertices = size_of(mesh);
    const int normal_bits = GENERATE(0, 8);
    const auto edges =
        costly_edges(mesh, vertices, {.normal_bits = normal_bits, .levels = {vertices}});
    REQUIRE_FALSE(edges.empty());
    CHECK(edges.size() <= 64);  // a fiftieth of 3600
    const std::set<Edge> all = edges_of(mesh);
    std::size_t across_lids = 0;
    for (const EdgeRecord& edge : edges) {
        CHECK(edge.among == vertices);
        CHECK(all.contains({edge.a, edge.b}));
        // Lids are spanned by edges from their first corner to others that are not next to it.
        across_lids += edge.a % 60 == 0 && edge.b % 60 > 1 && edge.b % 60 < 59 ? 1 : 0;
    }
    CHECK(across_lids > edges.size() / 2);
    CHECK(std::set(edges.begin(), edges.end()).size() == edges.size());
}

TEST_CASE("each level tells edges of the surface collapsed onto its vertices") {
    const TriangleMesh mesh = fan_lidded_drum(60, 60);
    const std::uint32_t vertices = size_of(mesh);
    const auto edges = costly_edges(mesh, vertices, {.levels = {900, 1800, vertices}});
    CHECK(std::is_sorted(edges.begin(), edges.end(),
                         [](const auto& x, const auto& y) { return x.among < y.among; }));
    TriangleMesh left = mesh;
    std::map<std::uint32_t, std::set<Edge>> edges_at{{vertices, edges_of(mesh)}};
    for (const std::uint32_t among : {1800u, 900u}) {
        std::vector<bool> keep(vertices, false);
        std::fill_n(keep.begin(), among, true);
        left = collapsed_onto(left, keep);
        edges_at[among] = edges_of(left);
    }
    std::set<std::uint32_t> seen;
    for (const EdgeRecord& edge : edges) {
        seen.insert(edge.among);
        REQUIRE(edge.b < edge.among);
        REQUIRE(edges_at.at(edge.among).contains({edge.a, edge.b}));
    }
    CHECK(seen.size() == 3);
}

TEST_CASE("positions that are no record have no edges told") {
    TriangleMesh mesh = fan_lidded_drum(60, 20);
    const std::uint32_t vertices = size_of(mesh) - 60;  // the upper rim is nobody's
    for (const EdgeRecord& edge : costly_edges(mesh, vertices, {.levels = {vertices}})) {
        CHECK(edge.b < vertices);
    }
}

TEST_CASE("a surface without triangles has no edges to tell") {
    TriangleMesh mesh = tests::icosphere(1);
    mesh.triangles.clear();
    CHECK(costly_edges(mesh, size_of(mesh), {.levels = {size_of(mesh)}}).empty());
}

}  // namespace ellicast::sender
