// tests/sender/ellipsoid_refinement_test.cpp
#include "sender/ellipsoid_refinement.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "common/coarse_surface.hpp"
#include "common/solid_voxels.hpp"
#include "sender/decomposition.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::TriangleMesh;
using Eigen::Vector3d;

std::vector<Ellipsoid> grown_in(const TriangleMesh& solid, std::size_t count) {
    DecompositionOptions options;
    options.candidates = 600;
    options.ellipsoids = count;
    options.grid = 48;
    options.refine = 0;
    return decompose(solid, options).ellipsoids;
}

// What the receiver's coarse surface has in common with the solid.
double overlap(const std::vector<Ellipsoid>& ellipsoids, const TriangleMesh& solid,
               const common::PromisedTopology& promise) {
    const auto surface = common::make_coarse_surface(
        {ellipsoids, {}, {}, common::bounding_box(solid.positions)}, promise, 96, 0);
    REQUIRE(surface);
    CHECK(surface->as_promised);
    return common::volume_overlap(surface->mesh, solid, 128);
}

bool equal(const std::vector<Ellipsoid>& a, const std::vector<Ellipsoid>& b) {
    return std::equal(
        a.begin(), a.end(), b.begin(), b.end(),
        [](const Ellipsoid& x, const Ellipsoid& y) { return x.center == y.center && x.L == y.L; });
}

constexpr common::PromisedTopology kBall{1, 2, 2};
constexpr common::PromisedTopology kRing{1, 0, 0};

}  // namespace

TEST_CASE("a wrong ellipsoid in a ball becomes the ball") {
    const TriangleMesh ball = tests::icosphere(5);
    Ellipsoid wrong;
    wrong.center = {0.1, -0.05, 0.08};
    wrong.L = Vector3d(0.85, 0.95, 0.9).asDiagonal();
    wrong.L(1, 0) = 0.1;
    RefinementOptions options;
    options.rounds = 40;
    const Ellipsoid found = refine_ellipsoids(std::vector{wrong}, ball, options).front();
    // The isosurface lies a quarter of a cell outside the ellipsoid.
    const double cell = 2.0 / options.grid;
    CHECK(found.center.norm() < 0.1 * cell);
    CHECK((common::semi_axes(found) - Vector3d::Constant(1.0 - 0.25 * cell)).norm() < 0.2 * cell);
}

TEST_CASE("refined ellipsoids have more of the solid, and its topology") {
    const TriangleMesh ring = tests::torus(1.0, 0.4, 60, 30);
    const std::vector<Ellipsoid> grown = grown_in(ring, 10);
    const std::vector<Ellipsoid> refined = refine_ellipsoids(grown, ring, {});
    REQUIRE(refined.size() == grown.size());
    CHECK(overlap(refined, ring, kRing) > overlap(grown, ring, kRing) + 0.01);
    CHECK(overlap(refined, ring, kRing) > 0.955);
}

TEST_CASE("refinement fills the corners of a box better") {
    const TriangleMesh box = tests::box({2.0, 1.0, 0.7}, 4);
    const std::vector<Ellipsoid> grown = grown_in(box, 60);
    CHECK(overlap(refine_ellipsoids(grown, box, {}), box, kBall) >
          overlap(grown, box, kBall) + 0.02);
}

TEST_CASE("threads change no bit of a refinement, and no round changes nothing") {
    const TriangleMesh ring = tests::torus(1.0, 0.4, 40, 20);
    const std::vector<Ellipsoid> grown = grown_in(ring, 30);
    RefinementOptions options;
    options.rounds = 6;
    options.threads = 1;
    const std::vector<Ellipsoid> one = refine_ellipsoids(grown, ring, options);
    options.threads = 3;
    CHECK(equal(refine_ellipsoids(grown, ring, options), one));
    CHECK_FALSE(equal(one, grown));
    options.rounds = 0;
    CHECK(equal(refine_ellipsoids(grown, ring, options), grown));
    CHECK(refine_ellipsoids({}, ring, options).empty());
}

TEST_CASE("a plate thinner than a cell keeps its ellipsoids") {
    const TriangleMesh plate = tests::box({1.0, 1.0, 0.004}, 10);
    const std::vector<Ellipsoid> grown = grown_in(plate, 40);
    const std::vector<Ellipsoid> refined = refine_ellipsoids(grown, plate, {});
    for (std::size_t i = 0; i < grown.size(); ++i) {
        CHECK(common::semi_axes(refined[i])[0] >= 0.99 * common::semi_axes(grown[i])[0]);
        CHECK(common::semi_axes(refined[i])[2] > 0.5 * common::semi_axes(grown[i])[2]);
    }
}

}  // namespace ellicast::sender
