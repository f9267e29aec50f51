// tests/sender/surface_facets_test.cpp
#include "sender/surface_facets.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

std::vector<std::uint32_t> all_triangles(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

// How far each triangle was moved along its outward normal.
std::vector<double> offsets(const TriangleMesh& mesh, double largest) {
    std::vector<double> out;
    const std::vector<Corners> moved = offset_triangles(mesh, all_triangles(mesh), largest);
    for (std::size_t f = 0; f < moved.size(); ++f) {
        const auto& [a, b, c] = mesh.triangles[f];
        const Vector3d n = (mesh.positions[b] - mesh.positions[a])
                               .cross(mesh.positions[c] - mesh.positions[a])
                               .normalized();
        const Vector3d by = moved[f][0] - mesh.positions[a];
        CHECK((by - n * n.dot(by)).norm() < 1e-12);
        CHECK((moved[f][2] - mesh.positions[c] - by).norm() < 1e-12);
        out.push_back(n.dot(by));
    }
    return out;
}

TEST_CASE("large triangles are those with a long edge") {
    const TriangleMesh box = tests::box({2.0, 1.0, 1.0}, 1);
    CHECK(large_triangles(box, 0.99).size() == 12);
    CHECK(large_triangles(box, 1.5).size() == 8);  // the ends' diagonals are 1.414
    CHECK(large_triangles(box, 3.0).empty());
}

TEST_CASE("flat faces with creases stay where they are") {
    for (const double offset : offsets(tests::cube(), 1.0)) CHECK(offset == 0.0);
    for (const double offset : offsets(tests::box({1.0, 2.0, 0.5}, 3), 1.0)) {
        CHECK(offset == Approx(0.0).margin(1e-15));
    }
}

TEST_CASE("triangles of a ball move out, by less than to the ball") {
    const TriangleMesh sphere = tests::icosphere(3);
    const std::vector<double> moved = offsets(sphere, 1.0);
    for (std::size_t f = 0; f < moved.size(); ++f) {
        const auto& [a, b, c] = sphere.triangles[f];
        const Vector3d centroid =
            (sphere.positions[a] + sphere.positions[b] + sphere.positions[c]) / 3.0;
        const double sagitta = 1.0 - centroid.norm();
        CHECK(moved[f] > 0.3 * sagitta);
        CHECK(moved[f] < sagitta);
    }
    for (const double offset : offsets(sphere, 1e-3)) CHECK(offset <= 1e-3 + 1e-15);
}

TEST_CASE("a tessellated cylinder's faces move by their sagitta, its ends stay") {
    constexpr int kSides = 24;
    TriangleMesh cylinder;
    for (const double z : {-1.0, 1.0}) {
        for (int k = 0; k < kSides; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / kSides;
            cylinder.positions.emplace_back(std::cos(angle), std::sin(angle), z);
        }
    }
    cylinder.positions.emplace_back(0.0, 0.0, -1.0);
    cylinder.positions.emplace_back(0.0, 0.0, 1.0);
    for (std::uint32_t k = 0; k < kSides; ++k) {
        const std::uint32_t next = (k + 1) % kSides;
        cylinder.triangles.push_back({k, next, kSides + next});
        cylinder.triangles.push_back({k, kSides + next, kSides + k});
        cylinder.triangles.push_back({2 * kSides, next, k});
        cylinder.triangles.push_back({2 * kSides + 1, kSides + k, kSides + next});
    }
    const double sagitta = 1.0 - std::cos(std::numbers::pi / kSides);
    const std::vector<double> moved = offsets(cylinder, 1.0);
    for (std::size_t f = 0; f < moved.size(); ++f) {
        CHECK(moved[f] == Approx(f % 4 < 2 ? sagitta : 0.0).margin(1e-12));
    }
}

TEST_CASE("concave edges move nothing") {
    TriangleMesh inverted = tests::icosphere(2);  // a cavity: every edge is concave
    for (common::Triangle& t : inverted.triangles) std::swap(t[1], t[2]);
    for (const double offset : offsets(inverted, 1.0)) CHECK(offset == 0.0);
}

}  // namespace
}  // namespace ellicast::sender
