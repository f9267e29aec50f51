// tests/sender/surface_samples_test.cpp
#include "sender/surface_samples.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

TEST_CASE("vertex normals point into the solid and are exact on spheres") {
    const TriangleMesh sphere = tests::icosphere(2);
    const std::vector<Vector3d> normals = inward_vertex_normals(sphere);
    for (std::size_t v = 0; v < normals.size(); ++v) {
        CHECK((normals[v] + sphere.positions[v].normalized()).norm() < 1e-12);
    }
}

TEST_CASE("vertices of no triangle are not used") {
    TriangleMesh mesh = tests::cube();
    mesh.positions.insert(mesh.positions.begin(), Vector3d(9.0, 9.0, 9.0));
    for (common::Triangle& t : mesh.triangles) {
        for (std::uint32_t& corner : t) ++corner;
    }
    CHECK(used_vertices(mesh) == std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6, 7, 8});
}

TEST_CASE("random points lie on the surface, evenly by area") {
    const TriangleMesh box = tests::box({4.0, 1.0, 1.0}, 3);
    common::Random random(1);
    const SurfaceSamples samples = random_surface_points(box, 1800, random);
    REQUIRE(samples.points.size() == 1800);
    std::size_t ends = 0;
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        const Vector3d inside = Vector3d(2.0, 0.5, 0.5) - samples.points[i].cwiseAbs();
        CHECK(inside.minCoeff() == Approx(0.0).margin(1e-12));
        CHECK(samples.inward[i].norm() == Approx(1.0));
        // The normal leads from the face that the point is on to the middle.
        CHECK(samples.inward[i].dot(samples.points[i]) < 0.0);
        if (std::abs(samples.inward[i][0]) > 0.9) ++ends;
    }
    CHECK(std::abs(static_cast<int>(ends) - 200) <= 4);  // 2 of 18 area units, stratified
}

TEST_CASE("seeds follow their number and nothing else") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 20, 10);
    const SurfaceSamples first = place_seeds(torus, 100, 3);
    CHECK(first.points == place_seeds(torus, 100, 3).points);
    CHECK(first.inward == place_seeds(torus, 100, 3).inward);
    CHECK(first.points != place_seeds(torus, 100, 4).points);
}

TEST_CASE("half of the seeds are distinct vertices where there are enough, the rest go by area") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 20, 10);
    for (const std::size_t count : {1u, 2u, 50u, 399u, 400u, 1000u}) {
        const SurfaceSamples seeds = place_seeds(torus, count, 1);
        REQUIRE(seeds.points.size() == count);
        REQUIRE(seeds.inward.size() == count);
        std::size_t at_vertex = 0;
        for (const Vector3d& p : seeds.points) {
            at_vertex += static_cast<std::size_t>(
                std::count(torus.positions.begin(), torus.positions.end(), p));
        }
        CHECK(at_vertex == std::min<std::size_t>(count / 2, 200));
    }
}

TEST_CASE("a cube of eight vertices is seeded on its faces") {
    const SurfaceSamples seeds = place_seeds(tests::cube(), 600, 1);
    CHECK(seeds.points.size() == 600);
    std::size_t on_faces = 0;
    for (const Vector3d& n : seeds.inward) {
        if (n.cwiseAbs().maxCoeff() > 0.999) ++on_faces;
    }
    CHECK(on_faces == 592);
}

TEST_CASE("degenerate triangles give no seed") {
    TriangleMesh mesh = tests::cube();
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), 3, Vector3d(0.5, 0.5, 0.5));
    mesh.triangles.push_back({n, n + 1, n + 2});
    const SurfaceSamples seeds = place_seeds(mesh, 200, 1);
    for (const Vector3d& normal : seeds.inward) CHECK(normal.norm() == Approx(1.0));

    TriangleMesh point;
    point.positions.assign(3, Vector3d(1.0, 1.0, 1.0));
    point.triangles = {{0, 1, 2}};
    CHECK(place_seeds(point, 10, 1).points.empty());
    CHECK(place_seeds(TriangleMesh{}, 10, 1).points.empty());
}

}  // namespace
}  // namespace ellicast::sender
