// tests/receiver/surface_distance_test.cpp
#include "receiver/surface_distance.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

TEST_CASE("distances are those of plain relaxation, cut at the reach") {
    const std::optional<SurfaceMesh> mesh = SurfaceMesh::from(tests::torus(1, 0.4, 14, 9));
    REQUIRE(mesh);
    common::Random random(6);
    const std::array<VertexId, 2> sources = {3, static_cast<VertexId>(random.below(100))};
    // Bellman-Ford as the oracle.
    std::vector<double> expected(mesh->vertex_slots(), std::numeric_limits<double>::infinity());
    for (const VertexId v : sources) expected[v] = 0;
    for (std::size_t round = 0; round < mesh->vertex_slots(); ++round) {
        for (HalfedgeId h = 0; h < 3 * mesh->face_slots(); ++h) {
            const VertexId a = mesh->from_vertex(h);
            const VertexId b = mesh->to_vertex(h);
            const double d = (mesh->position(a) - mesh->position(b)).norm();
            expected[b] = std::min(expected[b], expected[a] + d);
        }
    }
    for (const double reach : {0.5, 1.3, 100.0}) {
        const std::vector<double> found = distance_along_edges(*mesh, sources, reach);
        for (std::size_t v = 0; v < expected.size(); ++v) {
            if (expected[v] <= reach) {
                REQUIRE(found[v] == Approx(expected[v]));
            } else {
                REQUIRE(std::isinf(found[v]));
            }
        }
    }
}

TEST_CASE("without sources everything is infinitely far") {
    const std::optional<SurfaceMesh> mesh = SurfaceMesh::from(tests::cube());
    REQUIRE(mesh);
    for (const double d : distance_along_edges(*mesh, {}, 10.0)) REQUIRE(std::isinf(d));
}

}  // namespace
}  // namespace ellicast::receiver
