// tests/receiver/shrink_wrap_test.cpp
#include "receiver/shrink_wrap.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

double rms_radius_error(const common::TriangleMesh& mesh, double r) {
    double sum = 0.0;
    for (const Vector3d& p : mesh.positions) sum += std::pow(p.norm() - r, 2);
    return std::sqrt(sum / static_cast<double>(mesh.positions.size()));
}

std::vector<Vector3d> sphere_points(std::size_t n, bool upper_half_only) {
    common::Random random(3);
    std::vector<Vector3d> points;
    while (points.size() < n) {
        const Vector3d d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
        if (d.norm() < 0.1 || (upper_half_only && d.z() < 0)) continue;
        points.emplace_back(d.normalized());
    }
    return points;
}

TEST_CASE("a shrunken sphere comes out to the points") {
    common::TriangleMesh mesh = tests::icosphere(3, 0.93);
    const double volume = common::signed_volume(tests::icosphere(3, 1.0));
    shrink_wrap(mesh, sphere_points(5000, false), 3, 2);
    REQUIRE(rms_radius_error(mesh, 1.0) < 0.01);
    REQUIRE(common::signed_volume(mesh) == Approx(volume).epsilon(0.02));
}

TEST_CASE("vertices without points follow their neighbours and nothing is torn") {
    common::TriangleMesh mesh = tests::icosphere(3, 0.93);
    const std::vector<common::Triangle> triangles = mesh.triangles;
    shrink_wrap(mesh, sphere_points(3000, true), 3, 1);
    REQUIRE(mesh.triangles == triangles);
    for (const Vector3d& p : mesh.positions) {
        REQUIRE(p.norm() > 0.85);
        REQUIRE(p.norm() < 1.05);
    }
}

TEST_CASE("no points change nothing, threads change nothing") {
    common::TriangleMesh mesh = tests::icosphere(2);
    const std::vector<Vector3d> before = mesh.positions;
    shrink_wrap(mesh, {}, 3, 1);
    REQUIRE(mesh.positions == before);
    common::TriangleMesh other = mesh;
    const std::vector<Vector3d> points = sphere_points(300, false);
    shrink_wrap(mesh, points, 2, 1);
    shrink_wrap(other, points, 2, 5);
    REQUIRE(mesh.positions == other.positions);
}

TEST_CASE("points beyond eight a vertex are not asked") {
    common::TriangleMesh mesh = tests::icosphere(2, 0.97);
    common::TriangleMesh other = mesh;
    std::vector<Vector3d> points = sphere_points(8 * mesh.positions.size(), false);
    shrink_wrap(mesh, points, 3, 1);
    points.emplace_back(0, 0, 5);
    shrink_wrap(other, points, 3, 1);
    REQUIRE(mesh.positions == other.positions);
}

}  // namespace
}  // namespace ellicast::receiver
