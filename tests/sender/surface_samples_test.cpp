// tests/sender/surface_samples_test.cpp
#include "sender/surface_samples.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

std::vector<Vector3d> positions_of(const SurfaceSamples& samples, const TriangleMesh& mesh) {
    std::vector<Vector3d> out;
    for (const SurfacePoint& point : samples.points) out.push_back(point.position(mesh.positions));
    return out;
}

// Largest distance from random surface points to the nearest sample.
double largest_gap(const TriangleMesh& mesh, const SurfaceSamples& samples) {
    common::Random random(5);
    const std::vector<Vector3d> positions = positions_of(samples, mesh);
    double largest = 0.0;
    for (const SurfacePoint& probe : random_surface_points(mesh, 500, random).points) {
        const Vector3d x = probe.position(mesh.positions);
        double nearest = 1e300;
        for (const Vector3d& p : positions) nearest = std::min(nearest, (p - x).squaredNorm());
        largest = std::max(largest, std::sqrt(nearest));
    }
    return largest;
}

TEST_CASE("no point of a coarse surface is further than the spacing from a sample") {
    const TriangleMesh cube = tests::cube();
    for (const double spacing : {0.5, 0.1, 0.04}) {
        const SurfaceSamples samples = sample_surface(cube, spacing);
        CHECK(largest_gap(cube, samples) <= spacing);
        // Six unit faces: no more than some samples per square of the spacing.
        CHECK(static_cast<double>(samples.points.size()) < 4.0 * 6.0 / (spacing * spacing) + 100.0);
    }
}

TEST_CASE("slivers cost no more than their area and their edges") {
    TriangleMesh sliver;
    sliver.positions = {{0, 0, 0}, {1, 0, 0}, {0.5, 1e-4, 0}};
    sliver.triangles = {{0, 1, 2}, {0, 2, 1}};
    const SurfaceSamples samples = sample_surface(sliver, 0.01);
    CHECK(samples.points.size() < 3 + 2 * 101);
    CHECK(largest_gap(sliver, samples) <= 0.01);
}

TEST_CASE("a dense mesh gets its vertices alone, in order") {
    const TriangleMesh sphere = tests::icosphere(3);
    const SurfaceSamples samples = sample_surface(sphere, 0.5);
    REQUIRE(samples.points.size() == sphere.positions.size());
    for (std::uint32_t v = 0; v < samples.points.size(); ++v) {
        CHECK(samples.points[v].position(sphere.positions) == sphere.positions[v]);
    }
}

TEST_CASE("an edge's samples appear once however many triangles share it") {
    const TriangleMesh edge = tests::edge_shared_by_four();
    const std::vector<Vector3d> positions = positions_of(sample_surface(edge, 0.2), edge);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const bool both_are_vertices = i < edge.positions.size();
            CHECK((both_are_vertices || (positions[i] - positions[j]).norm() > 1e-9));
        }
    }
}

TEST_CASE("normals point into the solid and have unit length") {
    const TriangleMesh sphere = tests::icosphere(2);
    const SurfaceSamples samples = sample_surface(sphere, 0.1);
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        const Vector3d x = samples.points[i].position(sphere.positions);
        CHECK(samples.inward[i].norm() == Approx(1.0));
        CHECK(samples.inward[i].dot(-x.normalized()) > 0.98);
    }
    // [M99]'s weights are exact where all vertices lie on a sphere.
    const std::vector<Vector3d> at_vertices = inward_vertex_normals(sphere);
    for (std::size_t v = 0; v < at_vertices.size(); ++v) {
        CHECK((at_vertices[v] + sphere.positions[v].normalized()).norm() < 1e-12);
    }
}

TEST_CASE("a sample follows its mesh") {
    const TriangleMesh cube = tests::cube();
    const TriangleMesh moved = tests::translated(cube, {1.0, -2.0, 0.5});
    for (const SurfacePoint& point : sample_surface(cube, 0.3).points) {
        const Vector3d by = point.position(moved.positions) - point.position(cube.positions);
        CHECK((by - Vector3d(1.0, -2.0, 0.5)).norm() < 1e-12);
        CHECK(point.weights.minCoeff() >= -1e-15);
        CHECK(point.weights.sum() == Approx(1.0));
    }
}

TEST_CASE("random points lie evenly by area") {
    const TriangleMesh box = tests::box({4.0, 1.0, 1.0}, 3);
    common::Random random(1);
    const SurfaceSamples samples = random_surface_points(box, 1800, random);
    REQUIRE(samples.points.size() == 1800);
    std::size_t ends = 0;
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        const Vector3d x = samples.points[i].position(box.positions);
        CHECK(((x.cwiseAbs() - Vector3d(2.0, 0.5, 0.5)).array() <= 1e-12).all());
        if (std::abs(samples.inward[i][0]) > 0.9) ++ends;
    }
    CHECK(std::abs(static_cast<int>(ends) - 200) <= 4);  // 2 of 18 area units, stratified
}

TEST_CASE("random points follow the seed and nothing else") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 20, 10);
    common::Random a(3), b(3), c(4);
    const SurfaceSamples first = random_surface_points(torus, 100, a);
    const SurfaceSamples again = random_surface_points(torus, 100, b);
    const SurfaceSamples other = random_surface_points(torus, 100, c);
    CHECK(positions_of(first, torus) == positions_of(again, torus));
    CHECK(positions_of(first, torus) != positions_of(other, torus));
}

TEST_CASE("degenerate triangles give no sample inside and no normal") {
    TriangleMesh point;
    point.positions = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    point.triangles = {{0, 1, 2}};
    const SurfaceSamples samples = sample_surface(point, 0.1);
    CHECK(samples.points.size() == 3);
    for (const Vector3d& n : samples.inward) CHECK(n.isZero());
    common::Random random(1);
    CHECK(random_surface_points(point, 10, random).points.empty());
}

TEST_CASE("large triangles ask for closer samples") {
    TriangleMesh cube = tests::cube(1.0 / std::sqrt(3.0));
    TriangleMesh sphere = tests::icosphere(5, 0.5 / std::sqrt(3.0));
    CHECK(default_sample_spacing(cube) < default_sample_spacing(sphere));
}

}  // namespace
}  // namespace ellicast::sender
