// tests/common/distance_grid_test.cpp
#include "common/distance_grid.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/random.hpp"

namespace ellicast::common {
namespace {

Ellipsoid sphere(const Eigen::Vector3d& center, double r) {
    return {center, r * Eigen::Matrix3d::Identity()};
}

GridFrame frame_of(int n) {
    return {Eigen::Vector3d::Constant(-1.0), 2.0 / (n - 1), {n, n, n}};
}

TEST_CASE("the grid of a sphere holds signed distances next to its surface") {
    const GridFrame frame = frame_of(33);
    const DistanceGrid grid = make_distance_grid(std::vector{sphere({0.1, 0, 0}, 0.5)}, frame);
    int near = 0;
    for (int k = 1; k < 32; ++k) {
        for (int j = 1; j < 32; ++j) {
            for (int i = 1; i < 32; ++i) {
                const double d =
                    (frame.position(i, j, k) - Eigen::Vector3d(0.1, 0, 0)).norm() - 0.5;
                if (std::abs(d) > 2 * frame.spacing) continue;
                ++near;
                REQUIRE(grid.values[frame.index(i, j, k)] == Approx(d).margin(1e-6));
            }
        }
    }
    REQUIRE(near > 1000);
}

TEST_CASE("far nodes and the border are outside") {
    const GridFrame frame = frame_of(17);
    // Larger than the grid: all inner nodes lie inside, the border is outside all the same.
    const DistanceGrid grid = make_distance_grid(std::vector{sphere({0, 0, 0}, 5)}, frame);
    REQUIRE(grid.outside > 0);
    for (int j = 0; j < 17; ++j) {
        REQUIRE(grid.values[frame.index(0, j, 3)] == grid.outside);
        REQUIRE(grid.values[frame.index(j, 16, 3)] == grid.outside);
        REQUIRE(grid.values[frame.index(4, j, 16)] == grid.outside);
    }
    REQUIRE(grid.values[frame.index(8, 8, 8)] < 0);
}

std::vector<Ellipsoid> random_ellipsoids(Random& random, int count) {
    std::vector<Ellipsoid> ellipsoids;
    for (int n = 0; n < count; ++n) {
        Ellipsoid e;
        for (int a = 0; a < 3; ++a) e.center[a] = random.uniform() * 1.6 - 0.8;
        e.L << 0.05 + 0.2 * random.uniform(), 0, 0, 0.1 * random.uniform(),
            0.05 + 0.2 * random.uniform(), 0, 0.1 * random.uniform(), -0.1 * random.uniform(),
            0.05 + 0.2 * random.uniform();
        ellipsoids.push_back(e);
    }
    return ellipsoids;
}

// The header of common/ellipsoid.hpp, point by point.
double plain_estimate(const Ellipsoid& e, const Eigen::Vector3d& x) {
    const Eigen::Vector3d d = x - e.center;
    const Eigen::Matrix3d A = (e.L * e.L.transpose()).inverse();
    const double s = std::sqrt(d.dot(A * d));
    return s > 0.0 ? s * (s - 1.0) / (A * d).norm() : -semi_axes(e)[0];
}

TEST_CASE("the grid holds the least estimate of all whose padded box holds the node") {
    Random random(4);
    std::vector<Ellipsoid> ellipsoids = random_ellipsoids(random, 25);
    for (Ellipsoid& e : ellipsoids) e.L *= 2.0;  // so that they overlap
    const GridFrame frame = frame_of(27);
    ellipsoids.push_back(sphere(frame.position(20, 21, 22), 0.15));  // a node at d = 0
    const DistanceGrid grid = make_distance_grid(ellipsoids, frame);
    const double outside = grid.outside;
    for (int k = 1; k < 26; ++k) {
        for (int j = 1; j < 26; ++j) {
            for (int i = 1; i < 26; ++i) {
                const Eigen::Vector3d x = frame.position(i, j, k);
                double least = outside;
                for (const Ellipsoid& e : ellipsoids) {
                    Eigen::AlignedBox3d box = bounding_box(e);
                    box.min().array() -= 3.0 * frame.spacing;
                    box.max().array() += 3.0 * frame.spacing;
                    if (box.contains(x)) least = std::min(least, plain_estimate(e, x));
                }
                const double held = grid.values[frame.index(i, j, k)];
                REQUIRE(held == Approx(std::max(least, -outside)).margin(1e-6));
            }
        }
    }
}

TEST_CASE("order, copies and threads change no bit of the grid") {
    Random random(3);
    const std::vector<Ellipsoid> ellipsoids = random_ellipsoids(random, 40);
    const GridFrame frame = frame_of(30);
    const DistanceGrid once = make_distance_grid(ellipsoids, frame, 1);
    std::vector<Ellipsoid> again = ellipsoids;
    again.insert(again.end(), ellipsoids.begin(), ellipsoids.end());
    shuffle(again, random);
    REQUIRE(once.values == make_distance_grid(again, frame, 1).values);
    REQUIRE(once.values == make_distance_grid(ellipsoids, frame, 5).values);
    REQUIRE(std::all_of(once.values.begin(), once.values.end(),
                        [](float v) { return std::isfinite(v); }));
}

TEST_CASE("smoothing keeps a plane, fills a pit and does not depend on threads") {
    DistanceGrid grid;
    grid.frame.dims = {9, 8, 7};
    grid.values.resize(grid.frame.size());
    for (int k = 0; k < 7; ++k) {
        for (int j = 0; j < 8; ++j) {
            for (int i = 0; i < 9; ++i) {
                grid.values[grid.frame.index(i, j, k)] = static_cast<float>(i) - 4.0F;
            }
        }
    }
    CHECK(smoothed(grid, 0.25F).values == grid.values);
    const std::size_t pit = grid.frame.index(3, 4, 3);
    grid.values[pit] = 1.0F;
    const DistanceGrid soft = smoothed(grid, 0.25F, 1);
    CHECK(soft.values[pit] == Approx(-0.75F));
    CHECK(soft.values[grid.frame.index(0, 4, 3)] == -4.0F);
    CHECK(smoothed(grid, 0.25F, 3).values == soft.values);
    CHECK(smoothed(grid, 0.0F).values == grid.values);
}

TEST_CASE("a node on the centre of an ellipsoid gets minus its smallest semi-axis") {
    const GridFrame frame = frame_of(21);
    const Eigen::Vector3d node = frame.position(10, 10, 10);
    Ellipsoid e;
    e.center = node;
    e.L = Eigen::Vector3d(0.5, 0.2, 0.3).asDiagonal();
    const DistanceGrid grid = make_distance_grid(std::vector{e}, frame);
    REQUIRE(grid.values[frame.index(10, 10, 10)] == Approx(-0.2));
}

TEST_CASE("sampling interpolates linearly and is outside beyond the grid") {
    DistanceGrid grid;
    grid.frame = {Eigen::Vector3d(1, 2, 3), 0.5, {4, 3, 5}};
    grid.outside = 9;
    grid.values.resize(grid.frame.size());
    const auto f = [](const Eigen::Vector3d& x) { return 2 * x[0] - x[1] + 0.5 * x[2] - 1; };
    for (int k = 0; k < 5; ++k) {
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 4; ++i) {
                grid.values[grid.frame.index(i, j, k)] =
                    static_cast<float>(f(grid.frame.position(i, j, k)));
            }
        }
    }
    Random random(1);
    for (int n = 0; n < 200; ++n) {
        const Eigen::Vector3d x(1 + 1.5 * random.uniform(), 2 + random.uniform(),
                                3 + 2 * random.uniform());
        REQUIRE(sample(grid, x) == Approx(f(x)).margin(1e-5));
    }
    REQUIRE(sample(grid, {0.99, 2.5, 3.5}) == 9);
    REQUIRE(sample(grid, {2.51, 2.5, 3.5}) == 9);
}

}  // namespace
}  // namespace ellicast::common
