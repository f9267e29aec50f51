// tests/common/self_intersection_test.cpp
#include "common/self_intersection.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <vector>

#include "common/random.hpp"
#include "common/triangle_intersection.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast::common;
using namespace ellicast::tests;
using Eigen::Vector3d;

TEST_CASE("a surface that keeps off itself has no self-intersection") {
    for (const TriangleMesh& mesh :
         {TriangleMesh{}, cube(), icosphere(3), torus(2, 0.5, 30, 12), double_torus(2), two_parts(),
          nested_shells(), box({1, 2, 3}, 6), open_hemisphere(3), vertex_shared_by_two()}) {
        const SelfIntersections found = count_self_intersections(mesh);
        CHECK(found.pairs == 0);
        CHECK(found.faces == 0);
    }
}

TEST_CASE("a pierced triangle is one pair of two faces") {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, -1}, {1.5, 1, 1}, {1, 1.5, 1}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    CHECK(count_self_intersections(mesh).pairs == 1);
    CHECK(count_self_intersections(mesh).faces == 2);
    mesh.triangles = {{0, 1, 2}, {0, 4, 5}};  // they share a vertex
    CHECK(count_self_intersections(mesh).pairs == 0);
}

TEST_CASE("overlaps in one plane and touching corners count") {
    // Two cubes face to face: each of the two triangles of one face overlaps or touches both of the
    // other.
    const TriangleMesh face_to_face = join(cube(), translated(cube(0.5), Vector3d(0.75, 0, 0)));
    CHECK(count_self_intersections(face_to_face).pairs >= 4);
    const TriangleMesh corner_to_corner = join(cube(), translated(cube(), Vector3d(1, 1, 1)));
    CHECK(count_self_intersections(corner_to_corner).pairs > 0);
    // The same corner as one vertex: connected, not intersecting.
    CHECK(count_self_intersections(vertex_shared_by_two()).pairs == 0);
    const TriangleMesh apart = join(cube(), translated(cube(), Vector3d(1.0 + 1e-15, 0, 0)));
    CHECK(count_self_intersections(apart).pairs == 0);
}

TEST_CASE("self-intersections are those of brute force, on any number of threads") {
    const std::uint64_t seed = GENERATE(range(1, 6));
    CAPTURE(seed);
    Random random(seed);
    TriangleMesh mesh = icosphere(2);
    for (Vector3d& p : mesh.positions) p *= 0.3 + random.uniform();  // far from star-shaped
    for (Triangle& t : mesh.triangles) {
        if (random.chance(0.1))
            t[0] = static_cast<std::uint32_t>(random.below(mesh.positions.size()));
    }
    SelfIntersections expected;
    std::vector<bool> marked(mesh.triangles.size(), false);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t j = i + 1; j < mesh.triangles.size(); ++j) {
            const Triangle& s = mesh.triangles[i];
            const Triangle& t = mesh.triangles[j];
            if (std::find_first_of(s.begin(), s.end(), t.begin(), t.end()) != s.end()) continue;
            const auto corners = [&](const Triangle& k) -> TriangleCorners {
                return {mesh.positions[k[0]], mesh.positions[k[1]], mesh.positions[k[2]]};
            };
            if (!triangles_meet(corners(s), corners(t))) continue;
            ++expected.pairs;
            marked[i] = marked[j] = true;
        }
    }
    expected.faces = static_cast<std::size_t>(std::count(marked.begin(), marked.end(), true));
    CHECK(expected.pairs > 10);
    for (const unsigned threads : {1u, 2u, 5u}) {
        const SelfIntersections found = count_self_intersections(mesh, threads);
        CHECK(found.pairs == expected.pairs);
        CHECK(found.faces == expected.faces);
    }
}

TEST_CASE("moved vertices are searched where they are now, and suspects alone give their pairs") {
    TriangleMesh mesh = join(cube(), translated(cube(), Vector3d(3, 0, 0)));
    IntersectionSearch search(mesh);
    CHECK(search.faces(1).empty());
    const std::size_t half = mesh.positions.size() / 2;
    for (std::size_t v = half; v < mesh.positions.size(); ++v) {
        mesh.positions[v] -= Vector3d(2.5, 0.1, 0.1);
    }
    search.refit();
    const std::vector<std::uint32_t> all = search.faces(1);
    CHECK(all == self_intersecting_faces(mesh, 2));
    REQUIRE(all.size() > 4);
    std::vector<std::uint32_t> united;
    for (const std::uint32_t f : all) {
        const std::vector<std::uint32_t> with = search.faces_with(std::vector{f}, 1);
        CHECK(std::binary_search(with.begin(), with.end(), f));
        united.insert(united.end(), with.begin(), with.end());
    }
    std::sort(united.begin(), united.end());
    united.erase(std::unique(united.begin(), united.end()), united.end());
    CHECK(united == all);
}
