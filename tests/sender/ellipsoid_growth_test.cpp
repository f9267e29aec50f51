// tests/sender/ellipsoid_growth_test.cpp
#include "sender/ellipsoid_growth.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "common/random.hpp"
#include "sender/constraint_tree.hpp"
#include "sender/surface_facets.hpp"
#include "sender/surface_samples.hpp"
#include "tests/sender/constraint_scan.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::Random;
using common::TriangleMesh;
using Eigen::Matrix4d;
using Eigen::Vector3d;

Vector3d random_direction(Random& random) {
    for (;;) {
        const Vector3d v(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0,
                         2.0 * random.uniform() - 1.0);
        if (v.norm() > 0.1 && v.norm() <= 1.0) return v.normalized();
    }
}

// Points of the ellipsoid with the given semi-axes along x, y, z; no pole is among them by chance.
std::vector<Vector3d> ellipsoid_points(const Vector3d& axes, std::size_t count) {
    std::vector<Vector3d> points;
    for (std::size_t i = 0; i < count; ++i) {  // Fibonacci lattice
        const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
        const double angle = std::numbers::phi * 2.0 * std::numbers::pi * static_cast<double>(i);
        const double r = std::sqrt(1.0 - z * z);
        points.push_back(axes.cwiseProduct(Vector3d(r * std::cos(angle), r * std::sin(angle), z)));
    }
    return points;
}

// Points on the six faces of the box [-size/2, size/2], n x n each.
std::vector<Vector3d> box_points(const Vector3d& size, int n) {
    std::vector<Vector3d> points;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-0.5, 0.5}) {
            for (int i = 0; i <= n; ++i) {
                for (int j = 0; j <= n; ++j) {
                    Vector3d x;
                    x[axis] = side;
                    x[(axis + 1) % 3] = static_cast<double>(i) / n - 0.5;
                    x[(axis + 2) % 3] = static_cast<double>(j) / n - 0.5;
                    points.push_back(x.cwiseProduct(size));
                }
            }
        }
    }
    return points;
}

std::optional<Ellipsoid> grow(const Seed& seed, const std::vector<Vector3d>& points,
                              const GrowthOptions& options = {}) {
    const ConstraintTree tree({points, {}});
    GrowthContacts contacts;
    return grow_ellipsoid(seed, tree, tree, options, contacts);
}

// Least |L^-1 (x - c)| over the points: 1 when the nearest is touched.
double nearest(const Ellipsoid& ellipsoid, const std::vector<Vector3d>& points) {
    double least = 1e300;
    for (const Vector3d& x : points) {
        const Vector3d d = x - ellipsoid.center;
        least = std::min(least, ellipsoid.L.triangularView<Eigen::Lower>().solve(d).norm());
    }
    return least;
}

TouchingSphere some_sphere(double angle) {
    TouchingSphere sphere;
    sphere.center = Vector3d(0.1, -0.05, 0.2);
    sphere.radius = 0.15;
    sphere.p = sphere.center - sphere.radius * Vector3d::UnitZ();
    sphere.q = sphere.center +
               sphere.radius * Vector3d(std::sin(angle), 0.0, -std::cos(angle)).normalized();
    return sphere;
}

double value(const Matrix4d& Q, const Vector3d& x) {
    return x.homogeneous().dot(Q * x.homogeneous());
}

TEST_CASE("the sphere fills a sphere from any seed") {
    const double R = 0.25;
    const std::vector<Vector3d> points = ellipsoid_points(Vector3d::Constant(R), 4000);
    const ConstraintTree tree({points, {}});
    Random random(2);
    for (int i = 0; i < 20; ++i) {
        const Vector3d n = random_direction(random);
        const auto sphere = grow_sphere({-R * n, n}, tree, {}, {});
        REQUIRE(sphere);
        CHECK(sphere->radius == Approx(R).margin(0.002));
        CHECK(sphere->center.norm() < 0.002);
    }
}

TEST_CASE("the shifted contacts lie on the sphere, by epsilon inside the constraints") {
    const std::vector<Vector3d> points = box_points({0.6, 0.3, 0.3}, 40);
    const ConstraintTree tree({points, {}});
    GrowthOptions options;
    options.epsilon = 0.002;
    const Vector3d p(0.01, 0.02, -0.15);
    const auto sphere = grow_sphere({p, Vector3d::UnitZ()}, tree, options, {});
    REQUIRE(sphere);
    CHECK((sphere->p - sphere->center).norm() == Approx(sphere->radius));
    CHECK((sphere->q - sphere->center).norm() == Approx(sphere->radius));
    const Vector3d touched = points[sphere->touched];
    CHECK((sphere->q - touched).norm() == Approx(options.epsilon));
    // q' lies on the way from the touched point to the centre.
    CHECK((sphere->q - touched).normalized().dot((sphere->center - touched).normalized()) ==
          Approx(1.0));
    CHECK((sphere->p - p).norm() == Approx(1.01 * options.epsilon));
}

TEST_CASE("Q1 + alpha Q2 touches p and q with their normals, whatever alpha") {
    for (const double angle : {0.5, 1.5, 2.5, std::numbers::pi}) {
        const TouchingSphere sphere = some_sphere(angle);
        const Matrix4d Q1 = sphere_quadric(sphere), Q2 = wedge_quadric(sphere);
        const double largest = largest_alpha(sphere, 8.0);
        for (const double share : {0.0, 0.3, 1.0}) {
            const Matrix4d Q = Q1 + share * largest * Q2;
            for (const Vector3d& contact : {sphere.p, sphere.q}) {
                CHECK(value(Q, contact) == Approx(0.0).margin(1e-14));
                const Vector3d outward = (Q * contact.homogeneous()).head<3>();
                const Vector3d inward = sphere.center - contact;
                CHECK(outward.normalized().dot(inward.normalized()) == Approx(-1.0));
            }
        }
    }
}

TEST_CASE("Q2 is negative inside the wedge and positive beside it") {
    const TouchingSphere sphere = some_sphere(2.0);
    const Matrix4d Q2 = wedge_quadric(sphere);
    CHECK(value(Q2, sphere.center) < 0.0);
    CHECK(value(Q2, sphere.p + 0.1 * (sphere.p - sphere.center)) > 0.0);
    CHECK(value(Q2, sphere.q + 0.1 * (sphere.q - sphere.center)) > 0.0);
}

TEST_CASE(
    "the largest alpha gives exactly the aspect allowed, and alpha_0 ends the ellipsoid type") {
    for (const double angle : {0.5, 1.5, 2.5, std::numbers::pi}) {
        CAPTURE(angle);
        const TouchingSphere sphere = some_sphere(angle);
        const Matrix4d Q1 = sphere_quadric(sphere), Q2 = wedge_quadric(sphere);
        const auto at_limit = common::ellipsoid_from_quadric(Q1 + largest_alpha(sphere, 8.0) * Q2);
        REQUIRE(at_limit);
        const Vector3d axes = common::semi_axes(*at_limit);
        CHECK(axes[2] / axes[0] == Approx(8.0).epsilon(1e-6));
        if (angle > 3.0) continue;  // opposite contacts: alpha_0 is infinite
        const double cosine =
            (sphere.center - sphere.p).dot(sphere.center - sphere.q) / std::pow(sphere.radius, 2);
        const double alpha_0 = 2.0 / (std::pow(sphere.radius, 2) * (1.0 + cosine));
        CHECK(largest_alpha(sphere, 1e5) < alpha_0);
        CHECK(largest_alpha(sphere, 1e5) == Approx(alpha_0));
        CHECK_FALSE(common::ellipsoid_from_quadric(Q1 + 1.0001 * alpha_0 * Q2));
    }
}

TEST_CASE("the cylinder holds the section and is straight") {
    Random random(4);
    for (int i = 0; i < 50; ++i) {
        const TouchingSphere sphere = some_sphere(1.0 + random.uniform());
        const Matrix4d Q =
            sphere_quadric(sphere) + 0.5 * largest_alpha(sphere, 4.0) * wedge_quadric(sphere);
        const Vector3d n = random_direction(random);
        const Matrix4d Q3 = profile_cylinder(Q, sphere.p, n);
        CHECK((Q3 - Q3.transpose()).norm() < 1e-14);
        const Vector3d offset = 0.2 * random_direction(random);
        const Vector3d in_plane = sphere.p + offset - n * n.dot(offset);
        CHECK(value(Q3, in_plane) == Approx(value(Q, in_plane)).margin(1e-14));
        CHECK(value(Q3, in_plane + 3.0 * n) == Approx(value(Q, in_plane)).margin(1e-12));
        // Hence eq. (3) keeps the section for every beta.
        const double beta = 10.0 * random.uniform();
        CHECK(value(Q + beta * Q3, in_plane) ==
              Approx((1.0 + beta) * value(Q, in_plane)).margin(1e-12));
    }
}

TEST_CASE("an ellipsoid is recovered from the pole of its shortest axis") {
    const Vector3d axes(0.20, 0.13, 0.09);
    const std::vector<Vector3d> points = ellipsoid_points(axes, 20'000);
    const auto grown = grow({{0.0, 0.0, -axes[2]}, Vector3d::UnitZ()}, points);
    REQUIRE(grown);
    const Vector3d found = common::semi_axes(*grown);
    CHECK(found[0] == Approx(0.09).epsilon(0.02));
    CHECK(found[1] == Approx(0.13).epsilon(0.05));
    CHECK(found[2] == Approx(0.20).epsilon(0.10));
    CHECK(grown->center.norm() < 0.01);
}

TEST_CASE("in a long tube the ellipsoid is a cigar along it") {
    std::vector<Vector3d> points;
    for (int i = 0; i <= 200; ++i) {
        for (int k = 0; k < 64; ++k) {
            const double angle = 2.0 * std::numbers::pi * (k + 0.5 * (i % 2)) / 64;
            points.emplace_back(0.4 * (i / 100.0 - 1.0), 0.06 * std::cos(angle),
                                0.06 * std::sin(angle));
        }
    }
    for (const double side : {-0.4, 0.4}) {
        for (int k = -6; k <= 6; ++k) {
            for (int l = -6; l <= 6; ++l) points.emplace_back(side, 0.01 * k, 0.01 * l);
        }
    }
    const auto grown = grow({{0.0, 0.0, -0.06}, Vector3d::UnitZ()}, points);
    REQUIRE(grown);
    const Vector3d found = common::semi_axes(*grown);
    CHECK(found[0] == Approx(0.06).epsilon(0.03));
    CHECK(found[1] == Approx(0.06).epsilon(0.05));
    CHECK(found[2] > 0.34);
    CHECK(found[2] < 0.41);
    const Vector3d along = (grown->L * grown->L.transpose() * Vector3d::UnitX()).normalized();
    CHECK(std::abs(along[0]) > 0.999);
}

TEST_CASE("in a box the ellipsoid fills the box's height and touches its sides") {
    const Vector3d size(0.8, 0.5, 0.2);
    const std::vector<Vector3d> points = box_points(size, 80);
    const auto grown = grow({{0.0, 0.0, -0.1}, Vector3d::UnitZ()}, points);
    REQUIRE(grown);
    const Vector3d found = common::semi_axes(*grown);
    CHECK(found[0] == Approx(0.10).epsilon(0.02));
    CHECK(found[1] == Approx(0.25).epsilon(0.02));
    CHECK(found[2] == Approx(0.40).epsilon(0.02));
}

TEST_CASE("a thin plate gives flat ellipsoids as wide as the aspect allows") {
    const std::vector<Vector3d> points = box_points({0.7, 0.7, 0.02}, 200);
    const auto grown = grow({{0.0, 0.0, -0.01}, Vector3d::UnitZ()}, points);
    REQUIRE(grown);
    const Vector3d found = common::semi_axes(*grown);
    CHECK(found[0] == Approx(0.01).epsilon(0.05));
    CHECK(found[1] > 0.06);
    CHECK(found[2] <= 0.0801 * 1.1);
}

TEST_CASE("no point lies inside what was grown, and one is touched") {
    const TriangleMesh torus = tests::torus(0.3, 0.12, 60, 30);
    const std::vector<Vector3d> normals = inward_vertex_normals(torus);
    const ConstraintTree tree({torus.positions, {}});
    GrowthContacts contacts;
    std::size_t grown = 0;
    for (std::size_t i = 0; i < torus.positions.size(); i += 7) {
        const auto ellipsoid =
            grow_ellipsoid({torus.positions[i], normals[i]}, tree, tree, {}, contacts);
        if (!ellipsoid) continue;
        ++grown;
        CHECK(nearest(*ellipsoid, torus.positions) == Approx(1.0).margin(1e-9));
        const Vector3d axes = common::semi_axes(*ellipsoid);
        CHECK(axes[2] / axes[0] < 8.0 * 1.01);
        // The tube's half-thickness is the largest radius that fits.
        CHECK(axes[0] < 0.1201);
    }
    CHECK(grown > torus.positions.size() / 8);
}

TEST_CASE("whole triangles hold growth back where corners alone would not") {
    // A rod of 8 vertices: between the corners of its long faces there is nothing to meet.
    const Vector3d half(0.4, 0.03, 0.02);
    const TriangleMesh rod = tests::box(2.0 * half, 1);
    const std::vector<std::uint32_t> large = large_triangles(rod, 0.02);
    const ConstraintTree tree({rod.positions, offset_triangles(rod, large, 0.004)});
    const SurfaceSamples seeds = place_seeds(rod, 500, 1);
    GrowthContacts contacts;
    double largest = 0.0;
    for (std::size_t i = 0; i < seeds.points.size(); ++i) {
        const auto grown =
            grow_ellipsoid({seeds.points[i], seeds.inward[i]}, tree, tree, {}, contacts);
        if (!grown) continue;
        const Eigen::AlignedBox3d box = common::bounding_box(*grown);
        CHECK((box.max() - half).maxCoeff() < 1e-9);
        CHECK((-half - box.min()).maxCoeff() < 1e-9);
        largest = std::max(largest, common::volume(*grown));
    }
    // The best of them nearly is the largest ellipsoid of that aspect: 0.16 x 0.03 x 0.02.
    CHECK(largest > 0.9 * 4.0 / 3.0 * std::numbers::pi * 0.16 * 0.03 * 0.02);
}

TEST_CASE("unsmoothed samples are touched when the smoothed surface lies inside") {
    const std::vector<Vector3d> outer = ellipsoid_points({0.2, 0.13, 0.1}, 5000);
    std::vector<Vector3d> inner = outer;
    for (Vector3d& p : inner) p *= 0.97;
    GrowthContacts contacts;
    const auto grown =
        grow_ellipsoid({{0.0, 0.0, -0.097}, Vector3d::UnitZ()}, ConstraintTree({inner, {}}),
                       ConstraintTree({outer, {}}), {}, contacts);
    REQUIRE(grown);
    CHECK(nearest(*grown, outer) == Approx(1.0));
    CHECK(nearest(*grown, inner) < 1.0);
    CHECK(common::semi_axes(*grown)[0] == Approx(0.1).epsilon(0.02));
}

TEST_CASE("the tree grows what a plain scan grows, to the bit, warm or cold") {
    const TriangleMesh torus = tests::torus(0.3, 0.12, 40, 20);
    const std::vector<Vector3d> normals = inward_vertex_normals(torus);
    const std::vector<std::uint32_t> large = large_triangles(torus, 0.06);  // the outer half
    REQUIRE(large.size() > 100);
    REQUIRE(large.size() < torus.triangles.size());
    const Constraints constraints{torus.positions, offset_triangles(torus, large, 0.004)};
    const ConstraintTree tree(constraints);
    const tests::ConstraintScan scan(constraints);
    GrowthContacts warm;
    for (std::size_t i = 0; i < torus.positions.size(); i += 3) {
        GrowthContacts cold;
        const Seed seed{torus.positions[i], normals[i]};
        const auto by_tree = grow_ellipsoid(seed, tree, tree, {}, warm);
        const auto by_scan = grow_ellipsoid(seed, scan, scan, {}, cold);
        REQUIRE(by_tree.has_value() == by_scan.has_value());
        if (!by_tree) continue;
        CHECK(by_tree->center == by_scan->center);
        CHECK(by_tree->L == by_scan->L);
    }
}

TEST_CASE("an open or inverted surface grows nothing") {
    const std::vector<Vector3d> points = ellipsoid_points(Vector3d::Constant(0.2), 500);
    CHECK_FALSE(grow({{0.0, 0.0, 0.2}, Vector3d::UnitZ()}, points));  // outwards
    CHECK_FALSE(grow({{0.0, 0.0, 0.0}, Vector3d::UnitX()}, {}));
}

TEST_CASE("copies of the seed's own point do not stop its growth") {
    std::vector<Vector3d> points = ellipsoid_points(Vector3d::Constant(0.25), 2000);
    const Vector3d seed(0.0, 0.0, -0.25);
    for (int i = 0; i < 5; ++i) points.push_back(seed);
    const auto grown = grow({seed, Vector3d::UnitZ()}, points);
    REQUIRE(grown);
    CHECK(common::semi_axes(*grown)[0] > 0.24);
}

TEST_CASE("an ellipsoid thinner than the least radius is refused") {
    GrowthOptions options;
    options.min_radius = 0.02;
    const std::vector<Vector3d> points = box_points({0.7, 0.7, 0.02}, 100);
    CHECK_FALSE(grow({{0.0, 0.0, -0.01}, Vector3d::UnitZ()}, points, options));
}

}  // namespace
}  // namespace ellicast::sender
