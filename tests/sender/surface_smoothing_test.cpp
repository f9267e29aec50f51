// tests/sender/surface_smoothing_test.cpp
#include "sender/surface_smoothing.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

double largest_move(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
    double largest = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
    return largest;
}

double radius_variance(const std::vector<Vector3d>& positions) {
    double sum = 0.0, squares = 0.0;
    for (const Vector3d& p : positions) {
        sum += p.norm();
        squares += p.squaredNorm();
    }
    const auto n = static_cast<double>(positions.size());
    return squares / n - sum * sum / (n * n);
}

TEST_CASE("no step moves nothing") {
    const TriangleMesh sphere = tests::icosphere(2);
    CHECK(largest_move(smoothed_positions(sphere, 0), sphere.positions) == 0.0);
}

TEST_CASE("one step takes a vertex half-way to the mean of its neighbours") {
    // Octahedron: the four neighbours of every vertex have their mean at the origin.
    TriangleMesh octahedron;
    octahedron.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                            {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    const std::vector<Vector3d> once = smoothed_positions(octahedron, 1);
    for (std::size_t v = 0; v < once.size(); ++v) {
        CHECK((once[v] - 0.5 * octahedron.positions[v]).norm() < 1e-15);
    }
}

TEST_CASE("a sphere stays a sphere and shrinks by less each finer it is") {
    double before = 1.0;
    for (const int subdivisions : {1, 2, 3, 4}) {
        const TriangleMesh sphere = tests::icosphere(subdivisions);
        double smallest = 2.0, largest = 0.0;
        for (const Vector3d& p : smoothed_positions(sphere, 1)) {
            smallest = std::min(smallest, p.norm());
            largest = std::max(largest, p.norm());
        }
        const double shrinkage = 1.0 - smallest;
        CHECK(largest <= 1.0);
        CHECK(largest - smallest < shrinkage);  // even to its own size
        CHECK(shrinkage < 0.5 * before);
        before = shrinkage;
    }
}

TEST_CASE("smoothing takes noise away") {
    const TriangleMesh sphere = tests::icosphere(4);
    TriangleMesh noisy = sphere;
    common::Random random(1);
    for (Vector3d& p : noisy.positions) {
        p *= 1.0 + 0.01 * random.uniform();
    }
    const double before = radius_variance(noisy.positions);
    CHECK(radius_variance(smoothed_positions(noisy, 3)) < 0.2 * before);
}

TEST_CASE("vertices of no triangle stay where they are") {
    TriangleMesh mesh = tests::cube();
    mesh.positions.push_back({5.0, 6.0, 7.0});
    CHECK(smoothed_positions(mesh, 3).back() == Vector3d(5.0, 6.0, 7.0));
}

TEST_CASE("coarse meshes are not smoothed by default, dense ones are") {
    TriangleMesh coarse = tests::cube();
    TriangleMesh dense = tests::icosphere(6);  // 40962 vertices
    for (Vector3d& p : coarse.positions) p /= std::sqrt(3.0);
    for (Vector3d& p : dense.positions) p /= 2.0 * std::sqrt(3.0);
    CHECK(default_smoothing_steps(coarse) == 0);
    CHECK(default_smoothing_steps(dense) >= 1);
}

}  // namespace
}  // namespace ellicast::sender
