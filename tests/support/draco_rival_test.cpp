// tests/support/draco_rival_test.cpp
#include "tests/support/draco_rival.hpp"

#include <catch2/catch.hpp>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast::common;
using namespace ellicast::tests;

TEST_CASE("a mesh through Draco keeps its connectivity and almost its positions") {
    const TriangleMesh ring = torus(1.0, 0.4, 60, 30);
    const std::vector<char> bytes = draco_encode(ring);
    CHECK(bytes.size() < 5 * ring.positions.size());
    const TriangleMesh back = draco_decode(bytes);
    const MeshTopology topology = analyse_topology(back);
    CHECK(topology.vertices == ring.positions.size());
    CHECK(topology.faces == ring.triangles.size());
    CHECK(topology.closed);
    CHECK(topology.genus() == 1);
    CHECK(measure_distance(back, ring, {.samples = 5'000}).max < 1e-4);  // 2^-14 of the box
}

TEST_CASE("bytes that are no mesh are refused") {
    CHECK_THROWS(draco_decode({'n', 'o'}));
    std::vector<char> cut = draco_encode(icosphere(2));
    cut.resize(cut.size() / 2);
    CHECK_THROWS(draco_decode(cut));
}

TEST_CASE("behind an ideal code a message comes whole with its last byte or not at all") {
    CHECK(ideal_code_delivers(1000, 1000));
    CHECK(ideal_code_delivers(1001, 1000));
    CHECK_FALSE(ideal_code_delivers(999, 1000));
    CHECK_FALSE(ideal_code_delivers(0, 1));
}

TEST_CASE("Draco's bytes a vertex are the published ones") {
    const auto folder = models_dir();
    if (!folder) {
        WARN("SKIPPED: no reference models here (set ELLICAST_MODELS)");
        return;
    }
    const TriangleMesh rocker_arm = read_model(*folder / "rocker-arm.ply");
    CHECK(static_cast<double>(draco_encode(rocker_arm).size()) /
              static_cast<double>(rocker_arm.positions.size()) ==
          Approx(3.48).epsilon(0.02));
}
