// tests/receiver/surface_mesh_test.cpp
#include "receiver/surface_mesh.hpp"

#include <catch2/catch.hpp>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

SurfaceMesh surface(const common::TriangleMesh& mesh) {
    std::optional<SurfaceMesh> result = SurfaceMesh::from(mesh);
    REQUIRE(result);
    REQUIRE(result->validate().empty());
    return std::move(*result);
}

TEST_CASE("only closed oriented manifolds are taken") {
    REQUIRE(SurfaceMesh::from(tests::cube()));
    REQUIRE(SurfaceMesh::from(tests::torus(1, 0.3, 12, 8)));
    REQUIRE(SurfaceMesh::from(tests::two_parts()));
    REQUIRE_FALSE(SurfaceMesh::from(tests::open_hemisphere(2)));
    REQUIRE_FALSE(SurfaceMesh::from(tests::moebius_strip(9)));
    REQUIRE_FALSE(SurfaceMesh::from(tests::edge_shared_by_four()));
    REQUIRE_FALSE(SurfaceMesh::from(tests::vertex_shared_by_two()));
    REQUIRE_FALSE(SurfaceMesh::from(tests::inconsistent_orientation()));
    common::TriangleMesh unused = tests::cube();
    unused.positions.emplace_back(9, 9, 9);
    REQUIRE_FALSE(SurfaceMesh::from(unused));
    common::TriangleMesh wild = tests::cube();
    wild.triangles[0][1] = 77;
    REQUIRE_FALSE(SurfaceMesh::from(wild));
}

TEST_CASE("a face split and its collapse give the mesh back") {
    SurfaceMesh mesh = surface(tests::cube());
    const VertexId v = mesh.split_face(3, {0.1, 0.2, 0.3});
    REQUIRE(mesh.validate().empty());
    REQUIRE(mesh.valence(v) == 3);
    const common::MeshTopology split = common::analyse_topology(mesh.extract());
    REQUIRE(split.vertices == 9);
    REQUIRE(split.faces == 14);
    REQUIRE(split.euler == 2);
    const HalfedgeId h = mesh.outgoing(v);
    REQUIRE(mesh.can_collapse(h));
    mesh.collapse(h);
    REQUIRE(mesh.validate().empty());
    REQUIRE(common::analyse_topology(mesh.extract()).faces == 12);
    REQUIRE_FALSE(mesh.vertex_alive(v));
}

TEST_CASE("an edge split leaves four faces around the new vertex") {
    SurfaceMesh mesh = surface(tests::icosphere(1));
    const VertexId v = mesh.split_edge(17, {0, 0, 0});
    REQUIRE(mesh.validate().empty());
    REQUIRE(mesh.valence(v) == 4);
    REQUIRE(common::analyse_topology(mesh.extract()).euler == 2);
}

TEST_CASE("two flips of an edge give the same edge back") {
    SurfaceMesh mesh = surface(tests::icosphere(2));
    const VertexId a = mesh.from_vertex(10);
    const VertexId b = mesh.to_vertex(10);
    const VertexId c = mesh.opposite(10);
    const VertexId d = mesh.opposite(mesh.twin(10));
    REQUIRE(mesh.can_flip(10));
    mesh.flip(10);
    REQUIRE(mesh.validate().empty());
    REQUIRE(mesh.adjacent(c, d));
    REQUIRE_FALSE(mesh.adjacent(a, b));
    mesh.flip(10);
    REQUIRE(mesh.validate().empty());
    REQUIRE(mesh.adjacent(a, b));
}

TEST_CASE("a tetrahedron can neither be flipped nor collapsed") {
    common::TriangleMesh tetrahedron;
    tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const SurfaceMesh mesh = surface(tetrahedron);
    for (HalfedgeId h = 0; h < 12; ++h) {
        REQUIRE_FALSE(mesh.can_flip(h));
        REQUIRE_FALSE(mesh.can_collapse(h));
    }
}

TEST_CASE("slots that one takes are used, and what is left of them is used later") {
    SurfaceMesh mesh = surface(tests::cube());
    SurfaceMesh::Slots slots = mesh.take_slots(3);
    REQUIRE(mesh.vertex_slots() == 11);
    REQUIRE(mesh.face_slots() == 18);
    REQUIRE(mesh.validate().empty());
    REQUIRE(mesh.split_face(3, {0.1, 0.2, 0.3}, slots) == 8);
    REQUIRE(mesh.split_edge(17, {0.2, 0.2, 0.3}, slots) == 9);
    mesh.give_back(std::move(slots));
    REQUIRE(mesh.validate().empty());
    REQUIRE(common::analyse_topology(mesh.extract()).vertices == 10);
    REQUIRE(mesh.split_face(1, {0.3, 0.2, 0.3}) == 10);
    REQUIRE(mesh.face_slots() == 18);
    REQUIRE(mesh.split_face(1, {0.3, 0.2, 0.3}) == 11);
    REQUIRE(mesh.face_slots() == 20);
    REQUIRE(mesh.validate().empty());
    REQUIRE(common::analyse_topology(mesh.extract()).faces == 20);
}

TEST_CASE("a collapse that would pinch a tube is refused") {
    // Three vertices around the tube: collapsing an edge of such a ring would pinch it.
    const SurfaceMesh mesh = surface(tests::torus(1, 0.3, 8, 3));
    std::size_t refused = 0;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) refused += mesh.can_collapse(h) ? 0 : 1;
    REQUIRE(refused >= 8 * 3);
}

TEST_CASE("any sequence of legal edits keeps a manifold of the same topology") {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        INFO("seed " << seed);
        common::Random random(seed);
        const common::TriangleMesh start = seed % 3 == 0   ? tests::two_parts()
                                           : seed % 3 == 1 ? tests::torus(1, 0.4, 7, 5)
                                                           : tests::icosphere(1);
        const common::MeshTopology before = common::analyse_topology(start);
        SurfaceMesh mesh = surface(start);
        for (int edit = 0; edit < 600; ++edit) {
            const auto f = static_cast<FaceId>(random.below(mesh.face_slots()));
            if (!mesh.face_alive(f)) continue;
            const HalfedgeId h = SurfaceMesh::halfedge(f, static_cast<unsigned>(random.below(3)));
            const Eigen::Vector3d p(random.uniform(), random.uniform(), random.uniform());
            switch (random.below(6)) {
                case 0:
                    mesh.split_face(f, p);
                    break;
                case 1:
                    mesh.split_edge(h, p);
                    break;
                case 2:
                case 3:
                    if (mesh.can_flip(h)) mesh.flip(h);
                    break;
                default:
                    if (mesh.can_collapse(h)) mesh.collapse(h);
            }
            REQUIRE(mesh.validate().empty());
        }
        const common::MeshTopology after = common::analyse_topology(mesh.extract());
        REQUIRE(after.closed);
        REQUIRE(after.manifold);
        REQUIRE(after.euler == before.euler);
        REQUIRE(after.components == before.components);
    }
}

}  // namespace
}  // namespace ellicast::receiver
