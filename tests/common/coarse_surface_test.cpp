// tests/common/coarse_surface_test.cpp
#include "common/coarse_surface.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

Ellipsoid sphere(const Vector3d& center, double r) {
    return {center, r * Eigen::Matrix3d::Identity()};
}

// Beads on a ring; `missing` of them left out at the far side.
std::vector<Ellipsoid> ring(int beads, int missing) {
    std::vector<Ellipsoid> result;
    for (int n = 0; n < beads - missing; ++n) {
        const double a = 2.0 * std::numbers::pi * n / beads;
        result.push_back(sphere({0.35 * std::cos(a), 0.35 * std::sin(a), 0}, 0.08));
    }
    return result;
}

Eigen::AlignedBox3d box(double half) {
    return {Vector3d::Constant(-half), Vector3d::Constant(half)};
}

TEST_CASE("a single ellipsoid gives a closed sphere") {
    const auto surface =
        make_coarse_surface({std::vector{sphere({0, 0, 0}, 0.3)}, {}, {}, box(0.4)}, {}, 64, 1);
    REQUIRE(surface);
    REQUIRE(surface->as_promised);
    REQUIRE(analyse_topology(surface->mesh).closed);
    // The isolevel, a quarter of a cell, adds to the radius.
    REQUIRE(
        signed_volume(surface->mesh) ==
        Approx(4.0 / 3.0 * std::numbers::pi * std::pow(0.3 + surface->isolevel, 3)).epsilon(0.01));
}

TEST_CASE("an ellipsoid far smaller than a cell still gives a closed surface") {
    Random random(1);
    for (int n = 0; n < 50; ++n) {
        const Vector3d at(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
        const auto surface =
            make_coarse_surface({std::vector{sphere(0.8 * at, 1e-6)}, {}, {}, box(0.5)}, {}, 32, 1);
        REQUIRE(surface);
        REQUIRE(surface->as_promised);
    }
}

TEST_CASE("the isolevel that keeps the promise is chosen") {
    const PromisedTopology torus{1, 0, 0};
    const auto whole = make_coarse_surface({ring(24, 0), {}, {}, box(0.45)}, torus, 64, 1);
    REQUIRE(whole);
    REQUIRE(whole->as_promised);
    // Two beads apart by 0.18 with radius 0.08: a gap of 0.02, 1.5 cells, that a higher isolevel
    // closes.
    const auto gap = make_coarse_surface({ring(12, 0), {}, {}, box(0.45)}, torus, 64, 1);
    REQUIRE(gap);
    REQUIRE(gap->as_promised);
    REQUIRE(gap->isolevel >= 0.5 * gap->cell);
    const auto broken = make_coarse_surface({ring(24, 6), {}, {}, box(0.45)}, torus, 64, 1);
    REQUIRE(broken);
    REQUIRE_FALSE(broken->as_promised);
    REQUIRE(analyse_topology(broken->mesh).manifold);
}

TEST_CASE("debris beyond the promised components is dropped, a promised one is not") {
    const std::vector<Ellipsoid> pair = {sphere({-0.2, 0, 0}, 0.2), sphere({0.4, 0, 0}, 0.03)};
    const auto one = make_coarse_surface({pair, {}, {}, box(0.45)}, {1, 2, 2}, 64, 1);
    REQUIRE(one);
    REQUIRE(one->as_promised);
    const auto two = make_coarse_surface({pair, {}, {}, box(0.45)}, {2, 4, 2}, 64, 1);
    REQUIRE(two);
    REQUIRE(two->as_promised);
    REQUIRE(analyse_topology(two->mesh).components == 2);
}

TEST_CASE("points on the walls of a narrow gap keep it open") {
    // Two balls 0.45 cells apart, on both sides of a plane of nodes: even a quarter of a cell on
    // either side joins them.
    const GridFrame frame = make_grid_frame(box(0.45), 64, 4);
    const double cell = frame.spacing;
    const double plane = frame.position(frame.dims[0] / 2, 0, 0).x();
    const double r = 0.2;
    const Vector3d left(plane - r - 0.225 * cell, 0.003, 0.001);
    const Vector3d right(plane + r + 0.225 * cell, 0.003, 0.001);
    const std::vector<Ellipsoid> balls = {sphere(left, r), sphere(right, r)};
    const PromisedTopology promise{2, 4, 2};
    const auto blind = make_coarse_surface({balls, {}, {}, box(0.45)}, promise, 64, 1);
    REQUIRE(blind);
    REQUIRE_FALSE(blind->as_promised);
    std::vector<Vector3d> points;
    Random random(5);
    while (points.size() < 2000) {
        const Vector3d d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
        if (d.norm() < 0.1) continue;
        points.emplace_back((points.size() % 2 == 0 ? left : right) + r * d.normalized());
    }
    const auto seeing = make_coarse_surface({balls, points, {}, box(0.45)}, promise, 64, 1);
    REQUIRE(seeing);
    REQUIRE(seeing->as_promised);
}

struct OrientedPoints {
    std::vector<Vector3d> points;
    std::vector<Vector3d> normals;
};

// Anywhere on the tube of the ring without missing beads, its centre at `center`.
void add_tube(const Vector3d& center, int count, OrientedPoints& to) {
    Random random(7);
    for (int n = 0; n < count; ++n) {
        const double a = 2.0 * std::numbers::pi * random.uniform();
        const double b = 2.0 * std::numbers::pi * random.uniform();
        const Vector3d out(std::cos(a), std::sin(a), 0);
        const Vector3d normal = std::cos(b) * out + std::sin(b) * Vector3d::UnitZ();
        to.points.push_back(center + 0.35 * out + 0.08 * normal);
        to.normals.push_back(normal);
    }
}

TEST_CASE("points bridge the gap that lost ellipsoids leave, with normals or without") {
    OrientedPoints tube;
    add_tube(Vector3d::Zero(), 1000, tube);
    const PromisedTopology torus{1, 0, 0};
    const std::vector<Ellipsoid> broken = ring(24, 6);
    REQUIRE_FALSE(make_coarse_surface({broken, {}, {}, box(0.45)}, torus, 64, 1)->as_promised);
    const double volume = 2.0 * std::pow(std::numbers::pi * 0.08, 2) * 0.35;
    for (const bool oriented : {false, true}) {
        CAPTURE(oriented);
        std::vector<Vector3d> normals;
        if (oriented) normals = tube.normals;
        const auto mended =
            make_coarse_surface({broken, tube.points, normals, box(0.45)}, torus, 64, 1);
        REQUIRE(mended);
        REQUIRE(mended->as_promised);
        CHECK(signed_volume(mended->mesh) == Approx(volume).epsilon(0.25));
    }
}

TEST_CASE("normals carve a bridge that should not be") {
    // Ellipsoids that overlap by half a cell, and a surface that leaves a gap of two.
    const double cell = make_grid_frame(box(0.45), 64, 4).spacing;
    const double r = 0.2;
    const Vector3d left(-r + 0.25 * cell, 0, 0);
    const Vector3d right(r - 0.25 * cell, 0, 0);
    const std::vector<Ellipsoid> balls = {sphere(left, r), sphere(right, r)};
    OrientedPoints walls;
    Random random(5);
    while (walls.points.size() < 3000) {
        const Vector3d d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
        if (d.norm() < 0.1) continue;
        walls.normals.emplace_back(d.normalized());
        walls.points.emplace_back((walls.points.size() % 2 == 0 ? left : right) +
                                  (r - 1.25 * cell) * d.normalized());
    }
    const PromisedTopology two{2, 4, 2};
    const auto joined = make_coarse_surface({balls, {}, {}, box(0.45)}, two, 64, 1);
    REQUIRE_FALSE(joined->as_promised);
    const auto apart =
        make_coarse_surface({balls, walls.points, walls.normals, box(0.45)}, two, 64, 1);
    REQUIRE(apart->as_promised);
}

TEST_CASE("two parts with a gap each are mended and kept apart") {
    const Vector3d up(0, 0, 0.12);
    std::vector<Ellipsoid> rings;
    for (const Ellipsoid& bead : ring(24, 6)) {
        rings.push_back({bead.center + up, bead.L});
        rings.push_back({bead.center - up, bead.L});
    }
    OrientedPoints tubes;
    add_tube(up, 600, tubes);
    add_tube(-up, 600, tubes);
    const PromisedTopology tori{2, 0, 0};
    for (const bool oriented : {false, true}) {
        CAPTURE(oriented);
        std::vector<Vector3d> normals;
        if (oriented) normals = tubes.normals;
        const auto mended =
            make_coarse_surface({rings, tubes.points, normals, box(0.45)}, tori, 64, 1);
        REQUIRE(mended);
        REQUIRE(mended->as_promised);
    }
}

TEST_CASE("mending is the same on any number of threads") {
    OrientedPoints tube;
    add_tube(Vector3d::Zero(), 300, tube);
    const std::vector<Ellipsoid> broken = ring(24, 6);
    const CoarseEvidence evidence{broken, tube.points, tube.normals, box(0.45)};
    const auto one = make_coarse_surface(evidence, {1, 0, 0}, 48, 1);
    const auto many = make_coarse_surface(evidence, {1, 0, 0}, 48, 7);
    REQUIRE(one->mesh.positions == many->mesh.positions);
    REQUIRE(one->mesh.triangles == many->mesh.triangles);
}

TEST_CASE("the coarse surface is the same on any number of threads") {
    const std::vector<Vector3d> points = {{0.43, 0, 0}, {-0.43, 0.01, 0}, {0, 0.36, 0.07}};
    const auto one = make_coarse_surface({ring(20, 1), points, {}, box(0.45)}, {1, 0, 0}, 48, 1);
    const auto many = make_coarse_surface({ring(20, 1), points, {}, box(0.45)}, {1, 0, 0}, 48, 7);
    REQUIRE(one);
    REQUIRE(many);
    REQUIRE(one->mesh.positions == many->mesh.positions);
    REQUIRE(one->mesh.triangles == many->mesh.triangles);
}

}  // namespace
}  // namespace ellicast::common
