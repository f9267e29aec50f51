// tests/common/marching_cubes_test.cpp
#include "common/marching_cubes.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/distance_grid.hpp"
#include "common/mesh_topology.hpp"
#include "common/random.hpp"

namespace ellicast::common {
namespace {

GridFrame unit_frame(int n) {
    return {Eigen::Vector3d::Zero(), 1.0, {n, n, n}};
}

std::vector<float> sampled(const GridFrame& frame, double (*f)(const Eigen::Vector3d&)) {
    std::vector<float> values(frame.size());
    for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
            for (int i = 0; i < frame.dims[0]; ++i) {
                values[frame.index(i, j, k)] = static_cast<float>(f(frame.position(i, j, k)));
            }
        }
    }
    return values;
}

bool same(const TriangleMesh& a, const TriangleMesh& b) {
    return a.positions == b.positions && a.triangles == b.triangles;
}

TEST_CASE("any field gives a closed, oriented manifold") {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        INFO("seed " << seed);
        Random random(seed);
        const GridFrame frame = unit_frame(12);
        std::vector<float> values(frame.size());
        // From noise in which every ambiguous pattern occurs to nearly full and nearly empty grids.
        const double bias = random.uniform() * 1.6 - 0.8;
        for (float& v : values) v = static_cast<float>(random.uniform() * 2 - 1 + bias);
        const TriangleMesh mesh = marching_cubes(frame, values, 0.0F, 1);
        const MeshTopology topology = analyse_topology(mesh);
        REQUIRE(topology.closed);
        REQUIRE(topology.manifold);
        REQUIRE(topology.vertices == mesh.positions.size());
        REQUIRE(signed_volume(mesh) > 0);
    }
}

TEST_CASE("values that equal the isolevel, and constant runs, give no degenerate edges") {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        INFO("seed " << seed);
        Random random(seed);
        const GridFrame frame = unit_frame(9);
        std::vector<float> values(frame.size());
        for (float& v : values) v = static_cast<float>(random.below(3)) - 1.0F;
        const TriangleMesh mesh = marching_cubes(frame, values, 0.0F, 1);
        REQUIRE(analyse_topology(mesh).manifold);
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t i = 0; i < 3; ++i) {
                const double length =
                    (mesh.positions[t[i]] - mesh.positions[t[(i + 1) % 3]]).norm();
                REQUIRE(length > 0.02);
            }
        }
    }
}

TEST_CASE("a sphere's surface lies on the sphere") {
    const GridFrame frame = unit_frame(40);
    const auto values = sampled(frame, [](const Eigen::Vector3d& x) {
        return (x - Eigen::Vector3d(19.3, 19.6, 19.9)).norm() - 14.0;
    });
    const TriangleMesh mesh = marching_cubes(frame, values, 0.0F);
    const MeshTopology topology = analyse_topology(mesh);
    REQUIRE(topology.components == 1);
    REQUIRE(topology.euler == 2);
    for (const Eigen::Vector3d& p : mesh.positions) {
        // Linear interpolation errs by about h^2 / 8R = 0.009; the edge margin by 0.05.
        REQUIRE(std::abs((p - Eigen::Vector3d(19.3, 19.6, 19.9)).norm() - 14.0) < 0.06);
    }
    REQUIRE(signed_volume(mesh) == Approx(4.0 / 3.0 * M_PI * 14 * 14 * 14).epsilon(0.01));
}

TEST_CASE("a torus keeps its hole") {
    const GridFrame frame = unit_frame(40);
    const auto values = sampled(frame, [](const Eigen::Vector3d& x) {
        const Eigen::Vector3d d = x - Eigen::Vector3d::Constant(19.5);
        return std::hypot(std::hypot(d.x(), d.y()) - 11.0, d.z()) - 4.0;
    });
    REQUIRE(analyse_topology(marching_cubes(frame, values, 0.0F)).euler == 0);
}

TEST_CASE("a solid that runs into the border is closed there") {
    const GridFrame frame = unit_frame(8);
    const std::vector<float> values(frame.size(), -1.0F);
    const TriangleMesh mesh = marching_cubes(frame, values, 0.0F);
    const MeshTopology topology = analyse_topology(mesh);
    REQUIRE(topology.closed);
    REQUIRE(topology.euler == 2);
    // Border nodes are outside whatever their value; the crossing then lies half-way.
    for (const Eigen::Vector3d& p : mesh.positions) {
        REQUIRE(p.minCoeff() >= 0.5);
        REQUIRE(p.maxCoeff() <= 6.5);
    }
}

TEST_CASE("nothing inside gives an empty mesh") {
    const GridFrame frame = unit_frame(6);
    REQUIRE(marching_cubes(frame, std::vector<float>(frame.size(), 1.0F), 0.0F).triangles.empty());
    const GridFrame thin{Eigen::Vector3d::Zero(), 1.0, {2, 5, 5}};
    REQUIRE(marching_cubes(thin, std::vector<float>(thin.size(), -1.0F), 0.0F).triangles.empty());
}

TEST_CASE("marching cubes is the same on any number of threads") {
    Random random(7);
    const GridFrame frame{Eigen::Vector3d(1, 2, 3), 0.5, {13, 9, 17}};
    std::vector<float> values(frame.size());
    for (float& v : values) v = static_cast<float>(random.uniform() - 0.5);
    const TriangleMesh one = marching_cubes(frame, values, 0.05F, 1);
    for (const unsigned threads : {2U, 3U, 16U, 40U}) {
        REQUIRE(same(one, marching_cubes(frame, values, 0.05F, threads)));
    }
}

}  // namespace
}  // namespace ellicast::common
