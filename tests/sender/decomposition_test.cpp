// tests/sender/decomposition_test.cpp
#include "sender/decomposition.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::Random;
using common::TriangleMesh;
using Eigen::Vector3d;

DecompositionOptions quick_options() {
    DecompositionOptions options;
    options.candidates = 600;
    options.ellipsoids = 60;
    options.grid = 48;
    options.refine = 0;
    return options;
}

bool same_bits(const Decomposition& a, const Decomposition& b) {
    const auto equal = [](const Ellipsoid& x, const Ellipsoid& y) {
        return x.center == y.center && x.L == y.L;
    };
    return a.candidates == b.candidates && a.covered == b.covered && a.outside == b.outside &&
           std::equal(a.ellipsoids.begin(), a.ellipsoids.end(), b.ellipsoids.begin(),
                      b.ellipsoids.end(), equal);
}

TriangleMesh scaled(TriangleMesh mesh, double by) {
    for (Vector3d& p : mesh.positions) p *= by;
    return mesh;
}

Vector3d random_in_ball(Random& random) {
    for (;;) {
        const Vector3d u(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0,
                         2.0 * random.uniform() - 1.0);
        if (u.norm() <= 1.0) return u;
    }
}

bool covers(const std::vector<Ellipsoid>& ellipsoids, const Vector3d& x) {
    return std::any_of(ellipsoids.begin(), ellipsoids.end(), [&](const Ellipsoid& e) {
        const Vector3d d = x - e.center;
        return e.L.triangularView<Eigen::Lower>().solve(d).squaredNorm() <= 1.0;
    });
}

// Share of the random points of the solid that are covered; inside(x) says what belongs to it.
template <class Inside>
double coverage(const Decomposition& decomposition, const TriangleMesh& solid,
                const Inside& inside) {
    const Eigen::AlignedBox3d box = common::bounding_box(solid.positions);
    Random random(17);
    std::size_t all = 0, covered = 0;
    while (all < 4000) {
        const Vector3d u(random.uniform(), random.uniform(), random.uniform());
        const Vector3d x = box.min() + u.cwiseProduct(box.sizes());
        if (!inside(x)) continue;
        ++all;
        covered += covers(decomposition.ellipsoids, x) ? 1 : 0;
    }
    return static_cast<double>(covered) / static_cast<double>(all);
}

// How far ellipsoids reach out of a shape with signed distance `distance`, sampled on their
// surfaces.
template <class Distance>
double largest_reach(const std::vector<Ellipsoid>& ellipsoids, const Distance& distance) {
    Random random(23);
    double largest = -1e300;
    for (const Ellipsoid& e : ellipsoids) {
        for (int i = 0; i < 100; ++i) {
            const Vector3d u = random_in_ball(random).normalized();
            largest = std::max(largest, distance(Vector3d(e.center + e.L * u)));
        }
    }
    return largest;
}

double box_distance(const Vector3d& x, const Vector3d& half) {
    const Vector3d q = x.cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
}

double torus_distance(const Vector3d& x, double R, double r) {
    return std::hypot(std::hypot(x[0], x[1]) - R, x[2]) - r;
}

TEST_CASE("a ball is decomposed into nearly one ball") {
    const TriangleMesh ball = tests::icosphere(4);
    const Decomposition decomposition = decompose(ball, quick_options());
    const Vector3d axes = common::semi_axes(decomposition.ellipsoids.front());
    CHECK(axes[0] > 0.98);
    CHECK(axes[2] < 1.02);
    CHECK(decomposition.covered > 0.98);
    CHECK(decomposition.outside < 0.01);
}

TEST_CASE("a cube of eight vertices is filled and nothing pokes out") {
    for (const Criterion criterion : {Criterion::volume, Criterion::robust}) {
        DecompositionOptions options = quick_options();
        options.criterion = criterion;
        const TriangleMesh cube = tests::cube();
        const std::vector<Ellipsoid> candidates = grow_candidates(cube, options);
        CHECK(candidates.size() > 550);
        const Vector3d half = Vector3d::Constant(0.5);
        CHECK(largest_reach(candidates, [&](const Vector3d& x) { return box_distance(x, half); }) <
              1e-9);
        const Decomposition decomposition = decompose(cube, options);
        // A ball alone has 0.52 of the volume; the first is no smaller.
        CHECK(common::volume(decomposition.ellipsoids.front()) > 0.5);
        CHECK(coverage(decomposition, cube, [](const Vector3d&) { return true; }) > 0.9);
    }
}

TEST_CASE("plates, bars and rods of eight vertices are filled and nothing pokes out") {
    for (const Vector3d& size :
         {Vector3d(1.0, 1.0, 0.04), Vector3d(1.0, 0.1, 0.05), Vector3d(1.0, 0.04, 0.04)}) {
        CAPTURE(size.transpose());
        DecompositionOptions options = quick_options();
        options.grid = 128;
        options.candidates = 1500;
        options.ellipsoids = 300;
        const TriangleMesh box = tests::box(size, 1);
        const Vector3d half = 0.5 * size;
        CHECK(largest_reach(grow_candidates(box, options),
                            [&](const Vector3d& x) { return box_distance(x, half); }) < 1e-9);
        CHECK(coverage(decompose(box, options), box, [](const Vector3d&) { return true; }) > 0.75);
    }
}

TEST_CASE(
    "a torus is filled, round about, and candidates reach out by less than its facets are off") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 60, 30);
    const double diagonal = common::bounding_box(torus.positions).diagonal().norm();
    const auto distance = [](const Vector3d& x) { return torus_distance(x, 1.0, 0.3); };
    const DecompositionOptions options = quick_options();
    CHECK(largest_reach(grow_candidates(torus, options), distance) < 0.002 * diagonal);
    CHECK(coverage(decompose(torus, options), torus,
                   [&](const Vector3d& x) { return distance(x) < 0.0; }) > 0.93);
}

TEST_CASE("an ellipsoid is recovered") {
    TriangleMesh mesh = tests::icosphere(5);
    for (Vector3d& p : mesh.positions) p = p.cwiseProduct(Vector3d(1.0, 0.6, 0.4));
    const Decomposition decomposition = decompose(mesh, quick_options());
    const Vector3d axes = common::semi_axes(decomposition.ellipsoids.front());
    CHECK(axes[0] == Approx(0.4).epsilon(0.03));
    CHECK(axes[1] == Approx(0.6).epsilon(0.06));
    CHECK(axes[2] == Approx(1.0).epsilon(0.10));
}

TEST_CASE("threads change no bit") {
    const TriangleMesh torus = tests::torus(1.0, 0.4, 50, 25);
    DecompositionOptions options = quick_options();
    options.threads = 1;
    const Decomposition one = decompose(torus, options);
    for (const unsigned threads : {2u, 3u, 8u}) {
        options.threads = threads;
        CHECK(same_bits(decompose(torus, options), one));
    }
}

TEST_CASE("the seed matters, and the same seed gives the same") {
    const TriangleMesh torus = tests::torus(1.0, 0.4, 50, 25);
    DecompositionOptions options = quick_options();
    const Decomposition one = decompose(torus, options);
    CHECK(same_bits(decompose(torus, options), one));
    options.seed = 2;
    CHECK_FALSE(same_bits(decompose(torus, options), one));
}

TEST_CASE("fewer ellipsoids are the first of more") {
    const TriangleMesh torus = tests::torus(1.0, 0.4, 50, 25);
    DecompositionOptions options = quick_options();
    const Decomposition many = decompose(torus, options);
    options.ellipsoids = 7;
    Decomposition few = decompose(torus, options);
    REQUIRE(few.ellipsoids.size() == 7);
    for (std::size_t i = 0; i < 7; ++i) {
        CHECK(few.ellipsoids[i].center == many.ellipsoids[i].center);
        CHECK(few.ellipsoids[i].L == many.ellipsoids[i].L);
    }
    CHECK(few.covered < many.covered);
}

TEST_CASE("more candidates and more ellipsoids cover more") {
    const TriangleMesh torus = tests::torus(1.0, 0.4, 50, 25);
    const auto share = [&](const DecompositionOptions& options) {
        return coverage(decompose(torus, options), torus,
                        [](const Vector3d& x) { return torus_distance(x, 1.0, 0.4) < 0.0; });
    };
    DecompositionOptions options = quick_options();
    options.criterion = Criterion::volume;
    options.ellipsoids = 20;
    options.candidates = 100;
    const double few = share(options);
    options.candidates = 1000;
    const double more_candidates = share(options);
    options.ellipsoids = 60;
    CHECK(more_candidates > few + 0.005);
    CHECK(share(options) > more_candidates + 0.01);
}

TEST_CASE("scale and place do not matter") {
    const TriangleMesh torus = tests::torus(1.0, 0.4, 40, 20);
    const DecompositionOptions options = quick_options();
    const Decomposition plain = decompose(torus, options);
    // A power of two changes no rounding at all.
    const double big = 1048576.0;
    const Decomposition doubled = decompose(scaled(torus, big), options);
    REQUIRE(doubled.ellipsoids.size() == plain.ellipsoids.size());
    for (std::size_t i = 0; i < plain.ellipsoids.size(); ++i) {
        CHECK(doubled.ellipsoids[i].center == big * plain.ellipsoids[i].center);
        CHECK(doubled.ellipsoids[i].L == big * plain.ellipsoids[i].L);
    }
    CHECK(doubled.covered == plain.covered);
    for (const double scale : {1e-6, 1e6}) {
        const Decomposition other = decompose(scaled(torus, scale), options);
        CHECK(other.covered == Approx(plain.covered).margin(0.01));
        CHECK(other.outside < 0.01);
    }
    const Decomposition far = decompose(tests::translated(torus, {1e6, -3e5, 7e6}), options);
    CHECK(far.covered == Approx(plain.covered).margin(0.01));
    CHECK(far.outside < 0.01);
}

TEST_CASE("nasty meshes give ellipsoids that are finite and inside the box") {
    const std::vector<TriangleMesh> zoo = {tests::two_parts(),
                                           tests::overlapping_parts(),
                                           tests::nested_shells(),
                                           tests::edge_shared_by_four(),
                                           tests::vertex_shared_by_two(),
                                           tests::with_degenerates(),
                                           tests::inconsistent_orientation(),
                                           tests::double_torus(24)};
    for (std::size_t i = 0; i < zoo.size(); ++i) {
        CAPTURE(i);
        const Eigen::AlignedBox3d box = common::bounding_box(zoo[i].positions);
        DecompositionOptions options = quick_options();
        options.refine = 10;
        for (const Ellipsoid& e : decompose(zoo[i], options).ellipsoids) {
            CHECK(e.center.allFinite());
            CHECK(e.L.allFinite());
            CHECK(e.L.diagonal().minCoeff() > 0.0);
            CHECK(box.exteriorDistance(e.center) <= 1e-9 * box.diagonal().norm());
            CHECK(common::semi_axes(e)[2] < box.diagonal().norm());
        }
    }
}

TEST_CASE("each of several parts gets ellipsoids") {
    const Decomposition decomposition = decompose(tests::two_parts(), quick_options());
    std::size_t left = 0;
    const Vector3d middle = common::bounding_box(tests::two_parts().positions).center();
    Eigen::Index axis = 0;
    common::bounding_box(tests::two_parts().positions).sizes().maxCoeff(&axis);
    for (const Ellipsoid& e : decomposition.ellipsoids) {
        left += e.center[axis] < middle[axis] ? 1 : 0;
    }
    CHECK(left > 0);
    CHECK(left < decomposition.ellipsoids.size());
    CHECK(decomposition.covered > 0.95);
}

TEST_CASE("a cavity stays empty") {
    const TriangleMesh shell = tests::join(tests::icosphere(4), [] {
        TriangleMesh inner = tests::icosphere(3, 0.5);
        for (common::Triangle& t : inner.triangles) std::swap(t[1], t[2]);
        return inner;
    }());
    for (const Ellipsoid& e : grow_candidates(shell, quick_options())) {
        CHECK(e.center.norm() > 0.45);
    }
}

TEST_CASE("slivers and duplicate vertices do not stop growth") {
    // A box whose long sides are fans of needles, with all corners doubled.
    TriangleMesh mesh = tests::box({2.0, 1.0, 1.0}, 1);
    TriangleMesh needles;
    for (const common::Triangle& t : mesh.triangles) {
        const Vector3d a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        constexpr int kParts = 200;
        for (int k = 0; k < kParts; ++k) {
            const auto n = static_cast<std::uint32_t>(needles.positions.size());
            needles.positions.push_back(a);
            needles.positions.push_back(b + (c - b) * k / kParts);
            needles.positions.push_back(b + (c - b) * (k + 1) / kParts);
            needles.triangles.push_back({n, n + 1, n + 2});
        }
    }
    const Decomposition decomposition = decompose(needles, quick_options());
    const auto inside = [](const Vector3d&) { return true; };
    CHECK(coverage(decomposition, mesh, inside) > 0.88);
    const Vector3d half(1.0, 0.5, 0.5);
    CHECK(largest_reach(decomposition.ellipsoids,
                        [&](const Vector3d& x) { return box_distance(x, half); }) < 1e-9);
}

TEST_CASE("a shell too thin for any voxel is decomposed all the same") {
    for (const double thickness : {4e-3, 1e-4}) {
        CAPTURE(thickness);
        TriangleMesh plate = tests::box({1.0, 1.0, thickness}, 1);
        const Eigen::Matrix3d turn =
            Eigen::AngleAxisd(0.7, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
        for (Vector3d& p : plate.positions) p = turn * p;
        CHECK(decompose(plate, quick_options()).ellipsoids.size() > 20);
    }
}

TEST_CASE("what has no inside is refused in a line") {
    CHECK_THROWS_AS(decompose(TriangleMesh{}, quick_options()), std::invalid_argument);
    TriangleMesh point;
    point.positions.assign(3, Vector3d(1.0, 2.0, 3.0));
    point.triangles = {{0, 1, 2}};
    CHECK_THROWS_AS(decompose(point, quick_options()), std::invalid_argument);
    TriangleMesh inside_out = tests::icosphere(2);
    for (common::Triangle& t : inside_out.triangles) std::swap(t[1], t[2]);
    CHECK_THROWS_AS(decompose(inside_out, quick_options()), std::invalid_argument);
}

}  // namespace
}  // namespace ellicast::sender
