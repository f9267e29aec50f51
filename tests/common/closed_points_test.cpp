#include "common/closed_points.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "common/random.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

DistanceGrid empty_grid() {
    DistanceGrid grid;
    grid.frame = make_grid_frame({Vector3d::Constant(-0.5), Vector3d::Constant(0.5)}, 40, 8);
    grid.outside = static_cast<float>(6.0 * grid.frame.spacing);
    grid.values.assign(grid.frame.size(), grid.outside);
    return grid;
}

std::vector<Vector3d> points_on_sphere(std::size_t count) {
    std::vector<Vector3d> points;
    Random random(3);
    while (points.size() < count) {
        const Vector3d d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
        if (d.norm() > 0.1 && d.norm() < 0.5) points.emplace_back(0.4 * d.normalized());
    }
    return points;
}

TEST_CASE("points on a sphere enclose it when the balls do not get between them") {
    const DistanceGrid grid = empty_grid();
    const double h = grid.frame.spacing;
    const std::vector<Vector3d> points = points_on_sphere(800);
    const DistanceGrid closed = closed_points(grid, points, 4.0 * h);
    CHECK(sample(closed, Vector3d::Zero()) < -4.0 * h);
    for (const Vector3d& x : points) {
        CHECK(std::abs(sample(closed, x)) < 1.5 * h);
        CHECK(sample(closed, 0.8 * x) < 0.0);
        CHECK(sample(closed, 1.1 * x) > 0.0);
    }
    const DistanceGrid open = closed_points(grid, points_on_sphere(30), 2.0 * h);
    CHECK(sample(open, Vector3d::Zero()) > 0.0);
}

TEST_CASE("nothing is closed where there is nothing, and the border stays outside") {
    const DistanceGrid grid = empty_grid();
    const DistanceGrid closed = closed_points(grid, {}, 3.0 * grid.frame.spacing);
    for (const float v : closed.values) REQUIRE(v > 0.0F);
    const std::vector<Vector3d> beyond = {Vector3d::Constant(7.0)};
    const DistanceGrid clamped = closed_points(grid, beyond, 3.0 * grid.frame.spacing);
    REQUIRE(clamped.values.front() > 0.0F);
    REQUIRE(clamped.values.back() > 0.0F);
}

}  // namespace
}  // namespace ellicast::common
