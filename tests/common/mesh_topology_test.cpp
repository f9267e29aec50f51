// tests/common/mesh_topology_test.cpp
#include "common/mesh_topology.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "common/random.hpp"
#include "common/triangle_intersection.hpp"
#include "tests/support/meshes.hpp"

namespace {

using namespace ellicast::common;
using namespace ellicast::tests;
using Eigen::Vector3d;

void check_closed_manifold(const TriangleMesh& mesh, std::size_t components, std::int64_t genus) {
    const MeshTopology t = analyse_topology(mesh);
    CHECK(t.closed);
    CHECK(t.manifold);
    CHECK(t.boundary_edges == 0);
    CHECK(t.non_manifold_edges == 0);
    CHECK(t.non_manifold_vertices == 0);
    CHECK(t.components == components);
    CHECK(t.genus() == genus);
    CHECK(t.faces == mesh.triangles.size());
    CHECK(2 * t.edges == 3 * t.faces);
    CHECK(static_cast<std::int64_t>(t.vertices + t.faces) - static_cast<std::int64_t>(t.edges) ==
          t.euler);
}

// Renumbers vertices, shuffles triangles and turns their corners: the same surface.
TriangleMesh shuffled(const TriangleMesh& mesh, Random& random) {
    std::vector<std::uint32_t> rank(mesh.positions.size());
    for (std::uint32_t i = 0; i < rank.size(); ++i) rank[i] = i;
    shuffle(rank, random);
    TriangleMesh result;
    result.positions.resize(rank.size());
    for (std::size_t i = 0; i < rank.size(); ++i) result.positions[rank[i]] = mesh.positions[i];
    for (const Triangle& t : mesh.triangles) {
        const std::size_t turn = random.below(3);
        result.triangles.push_back(
            {rank[t[turn]], rank[t[(turn + 1) % 3]], rank[t[(turn + 2) % 3]]});
    }
    shuffle(result.triangles, random);
    return result;
}

}  // namespace

TEST_CASE("closed shapes have the genus of their kind") {
    check_closed_manifold(cube(), 1, 0);
    check_closed_manifold(icosphere(3), 1, 0);
    check_closed_manifold(box({1, 2, 3}, 5), 1, 0);
    check_closed_manifold(torus(2.0, 0.5, 24, 9), 1, 1);
    check_closed_manifold(double_torus(2), 1, 2);
    check_closed_manifold(two_parts(), 2, 0);
    check_closed_manifold(overlapping_parts(), 2, 0);
    check_closed_manifold(nested_shells(), 2, 0);
    check_closed_manifold(join(torus(2, 0.5, 12, 9), double_torus(1)), 2, 3);
}

TEST_CASE("a mesh without triangles is neither closed nor broken") {
    TriangleMesh points;
    points.positions = {{0, 0, 0}, {1, 2, 3}};
    for (const TriangleMesh& mesh : {TriangleMesh{}, points}) {
        const MeshTopology t = analyse_topology(mesh);
        CHECK(t.vertices == 0);
        CHECK(t.faces == 0);
        CHECK(t.components == 0);
        CHECK(t.euler == 0);
        CHECK_FALSE(t.closed);
        CHECK(t.manifold);
        CHECK(triangle_components(mesh).empty());
        CHECK(signed_volume(mesh) == 0.0);
        CHECK(surface_box(mesh).isEmpty());
    }
}

TEST_CASE("an open surface has as many boundary edges as its rim") {
    const MeshTopology t = analyse_topology(open_hemisphere(3));
    CHECK(t.boundary_edges == 4 * 8);
    CHECK_FALSE(t.closed);
    CHECK(t.manifold);
    CHECK(t.euler == 1);
    CHECK(t.components == 1);
}

TEST_CASE("a Moebius strip cannot be oriented, and that is all that is wrong with it") {
    const MeshTopology t = analyse_topology(moebius_strip(12));
    CHECK(t.non_manifold_edges == 1);  // where the ends meet
    CHECK(t.non_manifold_vertices == 0);
    CHECK(t.boundary_edges == 24);
    CHECK(t.euler == 0);
    CHECK_FALSE(t.manifold);
    CHECK_FALSE(t.closed);
}

TEST_CASE("an edge of four triangles is non-manifold and so are its ends") {
    const MeshTopology t = analyse_topology(edge_shared_by_four());
    CHECK(t.non_manifold_edges == 1);
    CHECK(t.non_manifold_vertices == 2);
    CHECK(t.components == 1);  // connected by that edge
    CHECK(t.vertices == 14);
    CHECK(t.closed);
    CHECK_FALSE(t.manifold);
}

TEST_CASE("a vertex of two fans is non-manifold though all edges are fine") {
    const MeshTopology t = analyse_topology(vertex_shared_by_two());
    CHECK(t.non_manifold_edges == 0);
    CHECK(t.non_manifold_vertices == 1);
    CHECK(t.components == 2);
    CHECK(t.vertices == 15);
    CHECK(t.euler == 3);
    CHECK(t.euler_largest == 2);
    CHECK(t.closed);
    CHECK_FALSE(t.manifold);
}

TEST_CASE("two open fans that touch in a point are non-manifold") {
    TriangleMesh bow_tie;
    bow_tie.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
    bow_tie.triangles = {{0, 1, 2}, {0, 3, 4}};
    const MeshTopology t = analyse_topology(bow_tie);
    CHECK(t.non_manifold_vertices == 1);
    CHECK(t.components == 2);
    CHECK(t.boundary_edges == 6);
}

TEST_CASE("three pages of a book share a non-manifold edge") {
    TriangleMesh book;
    book.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
    book.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
    const MeshTopology t = analyse_topology(book);
    CHECK(t.non_manifold_edges == 1);
    CHECK(t.non_manifold_vertices == 2);
    CHECK(t.components == 1);
    CHECK(t.boundary_edges == 6);
}

TEST_CASE("triangles that disagree on orientation are told, whole surface or not") {
    const MeshTopology t = analyse_topology(inconsistent_orientation());
    CHECK(t.non_manifold_edges > 0);
    CHECK(t.non_manifold_vertices == 0);
    CHECK(t.euler == 2);
    CHECK(t.closed);
    CHECK_FALSE(t.manifold);
    // All triangles turned round agree again.
    TriangleMesh inside_out = icosphere(2);
    for (Triangle& triangle : inside_out.triangles) std::swap(triangle[0], triangle[1]);
    check_closed_manifold(inside_out, 1, 0);
    CHECK(signed_volume(inside_out) < 0.0);
}

TEST_CASE("degenerate and repeated triangles are non-manifold, and nothing breaks") {
    const MeshTopology t = analyse_topology(with_degenerates());
    CHECK(t.faces == 18);
    CHECK(t.vertices == 9);
    CHECK_FALSE(t.manifold);
    CHECK(t.non_manifold_edges > 0);
    TriangleMesh copies = cube();
    copies.triangles.insert(copies.triangles.end(), copies.triangles.begin(),
                            copies.triangles.end());
    const MeshTopology twice = analyse_topology(copies);
    CHECK(twice.non_manifold_edges == 18);
    CHECK(twice.components == 1);
    CHECK(twice.closed);
}

TEST_CASE("unreferenced vertices do not count") {
    TriangleMesh mesh = icosphere(1);
    mesh.positions.emplace_back(100, 0, 0);
    check_closed_manifold(mesh, 1, 0);
    CHECK(surface_box(mesh).max()[0] < 2.0);
}

TEST_CASE("components are numbered in order of their first triangle") {
    const TriangleMesh a = cube();
    TriangleMesh mesh = join(a, translated(torus(2, 0.5, 8, 6), Vector3d(9, 0, 0)));
    mesh = join(mesh, translated(a, Vector3d(0, 5, 0)));
    // The last triangle moves to the front: its component becomes the first.
    std::rotate(mesh.triangles.begin(), mesh.triangles.end() - 1, mesh.triangles.end());
    const std::vector<std::uint32_t> component = triangle_components(mesh);
    REQUIRE(component.size() == 12 + 96 + 12);
    CHECK(component[0] == 0);
    for (std::size_t i = 1; i <= 12; ++i) CHECK(component[i] == 1);
    for (std::size_t i = 13; i < 13 + 96; ++i) CHECK(component[i] == 2);
    for (std::size_t i = 13 + 96; i < component.size(); ++i) CHECK(component[i] == 0);
}

TEST_CASE("the largest component is the one with the largest volume either way round") {
    TriangleMesh big_torus = torus(4, 1.5, 30, 12);
    for (Triangle& triangle : big_torus.triangles) std::swap(triangle[0], triangle[1]);
    const TriangleMesh mesh = join(icosphere(3), translated(big_torus, Vector3d(20, 0, 0)));
    const MeshTopology t = analyse_topology(mesh);
    CHECK(t.euler == 2);
    CHECK(t.euler_largest == 0);
}

TEST_CASE("volumes are those of the textbook, also far from the origin") {
    CHECK(signed_volume(cube(3.0)) == Approx(27.0).epsilon(1e-14));
    CHECK(signed_volume(box({1, 2, 3}, 4)) == Approx(6.0).epsilon(1e-14));
    const Vector3d far(1e6, -2e6, 3e6);
    CHECK(signed_volume(translated(cube(3.0), far)) == Approx(27.0).epsilon(1e-14));
    CHECK(signed_volume(icosphere(5)) == Approx(4.0 / 3.0 * std::numbers::pi).epsilon(1e-3));
    CHECK(signed_volume(torus(2, 0.5, 200, 100)) ==
          Approx(2.0 * std::numbers::pi * std::numbers::pi * 2.0 * 0.25).epsilon(2e-3));
    CHECK(signed_volume(double_torus(3)) == Approx(13.0).epsilon(1e-12));
    CHECK(signed_volume(nested_shells()) ==
          Approx(signed_volume(icosphere(3)) - signed_volume(icosphere(2, 0.5))).epsilon(1e-12));
}

TEST_CASE("numbering, order and first corners change nothing") {
    const std::uint64_t seed = GENERATE(range(1, 6));
    CAPTURE(seed);
    Random random(seed);
    for (const TriangleMesh& mesh :
         {torus(2, 0.5, 10, 7), moebius_strip(9), edge_shared_by_four(), vertex_shared_by_two(),
          with_degenerates(), open_hemisphere(2), inconsistent_orientation(), two_parts()}) {
        const MeshTopology a = analyse_topology(mesh);
        const MeshTopology b = analyse_topology(shuffled(mesh, random));
        CHECK(a.vertices == b.vertices);
        CHECK(a.edges == b.edges);
        CHECK(a.boundary_edges == b.boundary_edges);
        CHECK(a.non_manifold_edges == b.non_manifold_edges);
        CHECK(a.non_manifold_vertices == b.non_manifold_vertices);
        CHECK(a.components == b.components);
        CHECK(a.euler == b.euler);
        CHECK(a.euler_largest == b.euler_largest);
        CHECK(a.closed == b.closed);
        CHECK(a.manifold == b.manifold);
    }
}
