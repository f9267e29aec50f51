// tests/sender/clustered_surface_test.cpp
#include "sender/clustered_surface.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "sender/equal_positions.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {

using common::TriangleMesh;
using Eigen::Vector3d;

TEST_CASE("a clustered surface has one vertex in a cube, each one of the original's") {
    const TriangleMesh sphere = tests::translated(tests::icosphere(5), Vector3d(-0.3, 0.2, 1000.0));
    const double size = 0.1;
    const TriangleMesh clustered = clustered_surface(sphere, size);
    std::set<std::array<double, 3>> originals;
    for (const Vector3d& p : sphere.positions) originals.insert({p[0], p[1], p[2]});
    std::set<std::array<double, 3>> cubes;
    for (const Vector3d& p : clustered.positions) {
        REQUIRE(originals.count({p[0], p[1], p[2]}) == 1);
        const Vector3d cube = (p / size).array().floor();
        REQUIRE(cubes.insert({cube[0], cube[1], cube[2]}).second);
    }
    CHECK(clustered.positions.size() > 500);
    CHECK(clustered.positions.size() < 3'000);
}

TEST_CASE("a clustered surface lies by the original, encloses as much and uses all its vertices") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 400, 160);
    const TriangleMesh clustered = clustered_surface(torus, 0.025);
    CHECK(clustered.triangles.size() < torus.triangles.size() / 2);
    CHECK(common::signed_volume(clustered) == Approx(common::signed_volume(torus)).epsilon(0.01));
    CHECK(common::analyse_topology(clustered).vertices == clustered.positions.size());
    const common::MeshDistance distance =
        common::measure_distance(clustered, torus, {.samples = 20'000});
    const double diagonal = common::bounding_box(torus.positions).diagonal().norm();
    CHECK(distance.max * diagonal < 0.025);
}

TEST_CASE("cubes too small for two vertices leave the surface as it is") {
    const TriangleMesh sphere = tests::icosphere(3);
    const TriangleMesh clustered = clustered_surface(sphere, 1e-6);
    CHECK(clustered.positions.size() == sphere.positions.size());
    CHECK(clustered.triangles.size() == sphere.triangles.size());
}

TEST_CASE("of equal positions the first speaks for all, and zeros are equal") {
    const std::vector<std::array<double, 3>> positions{{1, 2, 3},    {0.0, 5, 6}, {1, 2, 3},
                                                       {-0.0, 5, 6}, {3, 2, 1},   {1, 2, 3}};
    const std::vector<std::uint32_t> first =
        first_equals(positions.size(), [&](std::size_t i) { return positions[i]; });
    CHECK(first == std::vector<std::uint32_t>{0, 1, 0, 1, 4, 0});
    CHECK(first_equals(0, [&](std::size_t i) { return positions[i]; }).empty());
}

}  // namespace ellicast::sender
