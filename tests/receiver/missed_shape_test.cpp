// tests/receiver/missed_shape_test.cpp
#include "receiver/missed_shape.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "tests/support/meshes.hpp"

using namespace ellicast;
using common::TriangleMesh;
using Eigen::Vector3d;
using receiver::MissedShape;

namespace {

// Of the points of a unit sphere, how many with z of this sign an icosahedron in it misses.
std::ptrdiff_t missed_points(const std::vector<double>& doubts, const TriangleMesh& concealed,
                             double sign) {
    const TriangleMesh few = tests::icosphere(0);
    const MissedShape missed(few, doubts, concealed);
    const TriangleMesh sphere = tests::icosphere(3);
    return std::count_if(sphere.positions.begin(), sphere.positions.end(),
                         [&](const Vector3d& p) { return sign * p.z() > 0.6 && missed.at(p); });
}

}  // namespace

TEST_CASE("what a mesh leaves flat is missed where the coarse surface was right") {
    const TriangleMesh few = tests::icosphere(0);
    const std::vector<double> right(few.positions.size(), 0.001);
    CHECK(missed_points(right, few, 1.0) > 50);
    CHECK(missed_points(right, few, -1.0) > 50);
    // A guess that is as round misses nothing.
    CHECK(missed_points(right, tests::icosphere(3), 1.0) == 0);
}

TEST_CASE("a coarse surface that was wrong at the vertices is not believed between them") {
    const TriangleMesh few = tests::icosphere(0);
    const std::vector<double> wrong(few.positions.size(), 0.1);
    CHECK(missed_points(wrong, few, 1.0) == 0);
    // It may be wrong in one place and right in another.
    std::vector<double> mixed(few.positions.size(), 0.001);
    for (std::size_t v = 0; v < mixed.size(); ++v) {
        if (few.positions[v].z() > 0.4) mixed[v] = 0.05;
    }
    CHECK(missed_points(mixed, few, 1.0) == 0);
    CHECK(missed_points(mixed, few, -1.0) > 20);
    // Where nothing was received nobody says that it was.
    for (double& doubt : mixed) {
        if (doubt > 0.01) doubt = -1.0;
    }
    CHECK(missed_points(mixed, few, 1.0) > 50);
}
