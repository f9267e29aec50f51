// tests/support/floor_test.cpp
#include "tests/support/floor.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast::common;
using namespace ellicast::tests;

namespace {

std::vector<bool> kept_of(std::size_t vertices, double loss, std::uint64_t seed) {
    Random random(seed);
    std::vector<bool> kept(vertices);
    for (std::size_t v = 0; v < vertices; ++v) kept[v] = !random.chance(loss);
    return kept;
}

std::set<std::uint32_t> used_by(const TriangleMesh& mesh) {
    std::set<std::uint32_t> used;
    for (const Triangle& triangle : mesh.triangles) used.insert(triangle.begin(), triangle.end());
    return used;
}

// Closed manifold of the original's topology on exactly the survivors, which did not move.
void check_collapsed(const TriangleMesh& original, const std::vector<bool>& kept) {
    const Collapsed floor = collapse_lost(original, kept);
    CHECK(floor.remaining == 0);
    CHECK(floor.mesh.positions == original.positions);
    std::set<std::uint32_t> survivors;
    for (std::uint32_t v = 0; v < kept.size(); ++v) {
        if (kept[v]) survivors.insert(v);
    }
    CHECK(used_by(floor.mesh) == survivors);
    const MeshTopology before = analyse_topology(original);
    const MeshTopology after = analyse_topology(floor.mesh);
    CHECK(after.closed);
    CHECK(after.manifold);
    CHECK(after.components == before.components);
    CHECK(after.euler == before.euler);
    CHECK(floor.removed.size() + survivors.size() == kept.size());
}

}  // namespace

TEST_CASE("the floor is a closed surface of the same genus on exactly the survivors") {
    for (const double loss : {0.0, 0.1, 0.5, 0.9}) {
        CAPTURE(loss);
        check_collapsed(icosphere(3), kept_of(642, loss, 1));
        check_collapsed(two_parts(), kept_of(two_parts().positions.size(), loss, 2));
        const TriangleMesh ring = torus(1.0, 0.4, 40, 20);
        check_collapsed(ring, kept_of(ring.positions.size(), loss, 3));
        const TriangleMesh rings = double_torus(4);
        check_collapsed(rings, kept_of(rings.positions.size(), loss, 4));
    }
}

TEST_CASE("a floor from which nothing was lost is the original") {
    const TriangleMesh sphere = icosphere(2);
    CHECK(collapse_onto(sphere, std::vector<bool>(162, true)).triangles == sphere.triangles);
}

TEST_CASE("losing vertices inside flat faces costs the floor nothing") {
    const TriangleMesh block = box({1, 2, 3}, 6);
    std::vector<bool> kept(block.positions.size());
    for (std::size_t v = 0; v < kept.size(); ++v) {
        const Eigen::Vector3d p = block.positions[v].cwiseAbs();
        kept[v] = ((p - Eigen::Vector3d(0.5, 1, 1.5)).array().abs() < 1e-9).count() >= 2;
    }
    check_collapsed(block, kept);  // what is left are the corners and the edges
    CHECK(measure_distance(collapse_onto(block, kept), block, {.samples = 2'000}).max < 1e-9);
}

TEST_CASE("a floor keeps what a closed surface cannot do without") {
    const Collapsed floor = collapse_lost(icosphere(1), std::vector<bool>(42, false));
    CHECK(floor.remaining == 4);  // a tetrahedron
    CHECK(analyse_topology(floor.mesh).closed);
    CHECK(analyse_topology(floor.mesh).manifold);
}

TEST_CASE("vertices of an open rim stay, and count as remaining") {
    const TriangleMesh bowl = open_hemisphere(2);
    const Collapsed floor = collapse_lost(bowl, std::vector<bool>(bowl.positions.size(), false));
    CHECK(floor.remaining > 0);
    CHECK(analyse_topology(floor.mesh).boundary_edges == analyse_topology(bowl).boundary_edges);
    CHECK(analyse_topology(floor.mesh).manifold);
}

TEST_CASE("decimation stops where it is told, and goes on where it stopped") {
    const TriangleMesh ring = torus(1.0, 0.4, 40, 20);
    const Collapsed half = decimate(ring, 400);
    CHECK(used_by(half.mesh).size() == 400);
    CHECK(half.removed.size() == 400);
    const Collapsed quarter = decimate(ring, 200);
    CHECK(used_by(quarter.mesh).size() == 200);
    CHECK(std::equal(half.removed.begin(), half.removed.end(), quarter.removed.begin()));
    CHECK(analyse_topology(quarter.mesh).genus() == 1);
    // Choosing which vertices go beats losing as many anywhere.
    const auto rms = [&](const TriangleMesh& mesh) {
        return measure_distance(mesh, ring, {.samples = 5'000}).rms();
    };
    CHECK(rms(quarter.mesh) < 0.7 * rms(collapse_onto(ring, kept_of(800, 0.75, 1))));
}
