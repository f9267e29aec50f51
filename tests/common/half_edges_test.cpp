// tests/common/half_edges_test.cpp
#include "common/half_edges.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <tuple>
#include <vector>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::common {
namespace {

using Row = std::tuple<std::uint64_t, std::uint32_t, std::uint32_t>;  // key, face, corner

std::vector<Row> rows_of(const std::vector<HalfEdge>& half_edges) {
    std::vector<Row> rows;
    for (const HalfEdge& h : half_edges) rows.emplace_back(h.key, h.face, h.corner);
    return rows;
}

std::vector<Row> plainly_sorted(const TriangleMesh& mesh) {
    std::vector<Row> rows;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        for (std::uint32_t c = 0; c < 3; ++c) {
            const std::uint64_t a = mesh.triangles[f][c];
            const std::uint64_t b = mesh.triangles[f][(c + 1) % 3];
            rows.emplace_back(std::min(a, b) << 32 | std::max(a, b), f, c);
        }
    }
    std::sort(rows.begin(), rows.end());
    return rows;
}

TEST_CASE("half-edges come by key, face and corner") {
    CHECK(sorted_half_edges({}).empty());
    const TriangleMesh sphere = tests::icosphere(3);
    CHECK(rows_of(sorted_half_edges(sphere)) == plainly_sorted(sphere));
    // Few vertices: edges with many triangles, vertices with many edges, repeated corners.
    Random random(5);
    for (const std::size_t vertices : {1, 3, 20, 200}) {
        TriangleMesh soup;
        soup.positions.resize(vertices);
        const auto corner = [&] { return static_cast<std::uint32_t>(random.below(vertices)); };
        for (int f = 0; f < 500; ++f) soup.triangles.push_back({corner(), corner(), corner()});
        CHECK(rows_of(sorted_half_edges(soup)) == plainly_sorted(soup));
    }
}

TEST_CASE("each edge is visited once, with all of its half-edges") {
    const TriangleMesh sphere = tests::icosphere(2);
    const std::vector<HalfEdge> half_edges = sorted_half_edges(sphere);
    std::size_t edges = 0;
    for_each_edge(half_edges, [&](const HalfEdge* first, const HalfEdge* last) {
        ++edges;
        REQUIRE(last - first == 2);
        REQUIRE(first[0].key == first[1].key);
        REQUIRE_FALSE(first->is_loop());
    });
    CHECK(2 * edges == half_edges.size());
}

}  // namespace
}  // namespace ellicast::common
