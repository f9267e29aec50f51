#include "common/normal_band.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

TEST_CASE("the band is the signed distance near a plane of points, and nothing far from it") {
    DistanceGrid grid;
    grid.frame = make_grid_frame({Vector3d::Constant(-0.5), Vector3d::Constant(0.5)}, 40, 2);
    grid.outside = 1.0F;
    grid.values.assign(grid.frame.size(), 0.7F);
    std::vector<Vector3d> points;
    for (int i = -5; i <= 5; ++i) {
        for (int j = -5; j <= 5; ++j) points.emplace_back(0.08 * i, 0.08 * j, 0.01);
    }
    const std::vector<Vector3d> normals(points.size(), Vector3d::UnitZ());
    NormalBand(points, normals, 0.12, grid.frame).blend_into(grid);
    for (const double z : {-0.03, 0.0, 0.03}) {
        CHECK(sample(grid, {0.01, 0.02, z}) == Approx(z - 0.01).margin(1e-6));
    }
    CHECK(sample(grid, {0, 0, 0.3}) == Approx(0.7));
    CHECK(sample(grid, {0, 0, -0.3}) == Approx(0.7));
}

}  // namespace
}  // namespace ellicast::common
