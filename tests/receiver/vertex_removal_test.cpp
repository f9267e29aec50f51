// tests/receiver/vertex_removal_test.cpp
#include "receiver/vertex_removal.hpp"

#include <catch2/catch.hpp>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

SurfaceMesh surface(const common::TriangleMesh& mesh) {
    std::optional<SurfaceMesh> result = SurfaceMesh::from(mesh);
    REQUIRE(result);
    return std::move(*result);
}

TEST_CASE("the removable vertices go, the others and the topology stay") {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        INFO("seed " << seed);
        const common::TriangleMesh start =
            seed % 2 == 0 ? tests::torus(1, 0.4, 40, 24) : tests::icosphere(4);
        const common::MeshTopology before = common::analyse_topology(start);
        SurfaceMesh mesh = surface(start);
        common::Random random(seed);
        std::vector<bool> removable(mesh.vertex_slots());
        std::size_t kept = 0;
        for (std::size_t v = 0; v < removable.size(); ++v) {
            removable[v] = random.chance(0.8);
            kept += removable[v] ? 0 : 1;
        }
        const std::size_t left = remove_vertices(mesh, [&](VertexId v) { return removable[v]; });
        REQUIRE(left == 0);
        REQUIRE(mesh.validate().empty());
        for (VertexId v = 0; v < removable.size(); ++v) {
            REQUIRE(mesh.vertex_alive(v) == !removable[v]);
        }
        const common::MeshTopology after = common::analyse_topology(mesh.extract());
        REQUIRE(after.vertices == kept);
        REQUIRE(after.euler == before.euler);
        REQUIRE(after.components == before.components);
    }
}

TEST_CASE("vertices go on several threads as on one, where the mesh is large enough for that") {
    std::vector<common::TriangleMesh> results;
    for (const unsigned threads : {1U, 3U}) {
        SurfaceMesh mesh = surface(tests::torus(1.0, 0.4, 240, 120));
        const auto removable = [](VertexId v) { return v % 3 != 0; };
        REQUIRE(remove_vertices(mesh, removable, threads) == 0);
        REQUIRE(mesh.validate().empty());
        results.push_back(mesh.extract());
        REQUIRE(results.back().positions.size() == 9'600);
        REQUIRE(common::analyse_topology(results.back()).euler == 0);
    }
    REQUIRE(results[0].triangles == results[1].triangles);
    REQUIRE(results[0].positions == results[1].positions);
}

TEST_CASE("taking the inner vertices off a box's faces leaves the box") {
    const common::TriangleMesh box = tests::box({1, 0.7, 0.5}, 6);
    SurfaceMesh mesh = surface(box);
    // An inner vertex of a face has one coordinate on the box; edge and corner vertices have two or
    // three.
    const Eigen::Vector3d half(0.5, 0.35, 0.25);
    const auto on_face_only = [&](VertexId v) {
        const Eigen::Vector3d d = half - mesh.position(v).cwiseAbs();
        return (d.array() < 1e-9).count() == 1;
    };
    REQUIRE(remove_vertices(mesh, on_face_only) == 0);
    REQUIRE(common::measure_distance(mesh.extract(), box).rms() < 1e-9);
}

TEST_CASE("where all may go, the last that carry the topology stay") {
    SurfaceMesh mesh = surface(tests::torus(1, 0.4, 12, 9));
    const std::size_t left = remove_vertices(mesh, [](VertexId) { return true; });
    REQUIRE(left >= 7);  // no triangulation of the torus has fewer vertices
    REQUIRE(mesh.validate().empty());
    REQUIRE(common::analyse_topology(mesh.extract()).euler == 0);
}

}  // namespace
}  // namespace ellicast::receiver
