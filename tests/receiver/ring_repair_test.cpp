// tests/receiver/ring_repair_test.cpp
#include "receiver/ring_repair.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "common/ring_tag.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

SurfaceMesh surface(const common::TriangleMesh& mesh) {
    std::optional<SurfaceMesh> result = SurfaceMesh::from(mesh);
    REQUIRE(result);
    return std::move(*result);
}

// What a sender would say of this mesh, record i being vertex i.
std::vector<RingWitness> witnesses_of(const SurfaceMesh& mesh) {
    std::vector<RingWitness> witnesses(mesh.vertex_slots());
    for (VertexId v = 0; v < witnesses.size(); ++v) {
        unsigned sum = 0;
        mesh.for_each_outgoing(v,
                               [&](HalfedgeId h) { sum += common::ring_hash(mesh.to_vertex(h)); });
        witnesses[v] = {common::ring_hash(v),
                        static_cast<std::uint8_t>(common::ring_tag(mesh.valence(v), sum)), true};
    }
    return witnesses;
}

std::vector<std::array<VertexId, 2>> edges_of(const SurfaceMesh& mesh) {
    std::vector<std::array<VertexId, 2>> edges;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        if (mesh.from_vertex(h) < mesh.to_vertex(h)) {
            edges.push_back({mesh.from_vertex(h), mesh.to_vertex(h)});
        }
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

// Of convex flat quads only, so that no face turns over.
std::size_t flip_at_random(SurfaceMesh& mesh, std::uint64_t seed, std::size_t attempts) {
    common::Random random(seed);
    std::size_t flips = 0;
    for (std::size_t n = 0; n < attempts; ++n) {
        const auto h = static_cast<HalfedgeId>(random.below(3 * mesh.face_slots()));
        if (!mesh.can_flip(h)) continue;
        const HalfedgeId t = mesh.twin(h);
        const Vector3d up = mesh.area_normal(SurfaceMesh::face_of(h)).normalized() +
                            mesh.area_normal(SurfaceMesh::face_of(t)).normalized();
        mesh.flip(h);
        ++flips;
        if (mesh.area_normal(SurfaceMesh::face_of(h)).dot(up) <= 0.0 ||
            mesh.area_normal(SurfaceMesh::face_of(t)).dot(up) <= 0.0) {
            mesh.flip(h);
            --flips;
        }
    }
    return flips;
}

// A sphere whose vertices were moved along it.
common::TriangleMesh uneven_sphere() {
    common::TriangleMesh mesh = tests::icosphere(4);
    common::Random random(7);
    for (Vector3d& p : mesh.positions) {
        const Vector3d by(random.uniform(), random.uniform(), random.uniform());
        p = (p + 0.04 * (by - Vector3d::Constant(0.5))).normalized();
    }
    return mesh;
}

void check_undone(const common::TriangleMesh& original, std::size_t attempts) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        INFO("seed " << seed);
        SurfaceMesh mesh = surface(original);
        const std::vector<RingWitness> witnesses = witnesses_of(mesh);
        const auto edges = edges_of(mesh);
        REQUIRE(flip_at_random(mesh, seed, attempts) > attempts / 4);
        REQUIRE(edges_of(mesh) != edges);
        REQUIRE(ring_agreement(mesh, witnesses).disagree > 0);
        const RingAgreement result = repair_rings(mesh, witnesses);
        REQUIRE(result.disagree == 0);
        REQUIRE(result.agree == original.positions.size());
        REQUIRE(mesh.validate().empty());
        REQUIRE(edges_of(mesh) == edges);
    }
}

TEST_CASE("scattered random flips of a torus are undone exactly") {
    check_undone(tests::torus(1, 0.4, 48, 32), 150);
}

TEST_CASE("random flips of one edge in ten of an uneven sphere are undone exactly") {
    check_undone(uneven_sphere(), 1000);
}

TEST_CASE("a mesh whose rings agree stays as it is") {
    SurfaceMesh mesh = surface(uneven_sphere());
    const auto before = mesh.extract();
    const RingAgreement result = repair_rings(mesh, witnesses_of(mesh));
    REQUIRE(result.disagree == 0);
    REQUIRE(mesh.extract().triangles == before.triangles);
}

TEST_CASE("tags made up by an enemy cost bounded work and no topology") {
    for (const bool lossy : {false, true}) {
        SurfaceMesh mesh = surface(tests::torus(1, 0.4, 24, 16));
        common::Random random(3);
        std::vector<RingWitness> witnesses(mesh.vertex_slots());
        for (RingWitness& witness : witnesses) {
            witness = {static_cast<std::uint8_t>(random.below(256)),
                       static_cast<std::uint8_t>(random.below(256)), random.chance(0.9)};
        }
        const RingAgreement before = ring_agreement(mesh, witnesses);
        const RingAgreement after = repair_rings(mesh, witnesses, lossy);
        REQUIRE(after.agree + after.disagree == before.agree + before.disagree);
        REQUIRE(mesh.validate().empty());
        const common::MeshTopology topology = common::analyse_topology(mesh.extract());
        REQUIRE(topology.closed);
        REQUIRE(topology.manifold);
        REQUIRE(topology.components == 1);
        REQUIRE(topology.genus() == 1);
    }
}

TEST_CASE("a tetrahedron with wrong tags stays a tetrahedron") {
    SurfaceMesh mesh = surface({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}});
    const std::vector<RingWitness> witnesses(4, {9, 0, true});
    REQUIRE(repair_rings(mesh, witnesses).disagree == 4);
    REQUIRE(mesh.validate().empty());
}

TEST_CASE("vertices without a tag don't matter, and ring repair is deterministic") {
    const common::TriangleMesh original = uneven_sphere();
    SurfaceMesh a = surface(original);
    std::vector<RingWitness> witnesses = witnesses_of(a);
    for (std::size_t v = 0; v < witnesses.size(); v += 10) {
        witnesses[v].tag = static_cast<std::uint8_t>(v);
        witnesses[v].judged = false;
    }
    const auto edges = edges_of(a);
    flip_at_random(a, 11, 600);
    SurfaceMesh b = a;
    REQUIRE(repair_rings(a, witnesses).disagree == 0);
    repair_rings(b, witnesses);
    REQUIRE(a.extract().triangles == b.extract().triangles);
    REQUIRE(edges_of(a) == edges);
}

}  // namespace
}  // namespace ellicast::receiver
