// tests/bench/marching_cubes_bench.cpp: marching cubes beside one pass over the grid's values.
//
// Input: the field of 400 small balls whose centres lie on a torus; the argument is the number of
// nodes on each axis. One thread. The pass counts what is below the isolevel, which is the least
// that any extraction must read.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "common/distance_grid.hpp"
#include "common/ellipsoid.hpp"
#include "common/marching_cubes.hpp"
#include "common/mesh_topology.hpp"

namespace ellicast {
namespace {

constexpr int kBalls = 400;

common::DistanceGrid field(int nodes) {
    const common::GridFrame frame{
        Eigen::Vector3d::Constant(-1.0), 2.0 / (nodes - 1), {nodes, nodes, nodes}};
    std::vector<common::Ellipsoid> balls;
    for (int n = 0; n < kBalls; ++n) {
        const double around = 6.283185307179586 * n / kBalls;
        const double across = 40.0 * around;
        const double r = 0.55 + 0.15 * std::cos(across);
        balls.push_back({{r * std::cos(around), r * std::sin(around), 0.15 * std::sin(across)},
                         0.12 * Eigen::Matrix3d::Identity()});
    }
    return common::make_distance_grid(balls, frame);
}

int nodes_of(const benchmark::State& state) {
    const bool small = std::getenv("ELLICAST_BENCH_SMALL") != nullptr;
    return small ? 48 : static_cast<int>(state.range(0));
}

void set_nodes(benchmark::State& state, const common::DistanceGrid& grid) {
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(grid.values.size()));
    state.SetLabel("400 balls along a torus");
}

void one_pass(benchmark::State& state) {
    const common::DistanceGrid grid = field(nodes_of(state));
    for (auto _ : state) {
        benchmark::DoNotOptimize(std::count_if(grid.values.begin(), grid.values.end(),
                                               [](float v) { return v < 0.0F; }));
    }
    set_nodes(state, grid);
}
BENCHMARK(one_pass)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond);

void extract(benchmark::State& state) {
    const common::DistanceGrid grid = field(nodes_of(state));
    common::TriangleMesh mesh;
    for (auto _ : state) mesh = common::marching_cubes(grid.frame, grid.values, 0.0F, 1);
    const common::MeshTopology topology = common::analyse_topology(mesh);
    if (!topology.closed || !topology.manifold || common::signed_volume(mesh) < 0.3) {
        state.SkipWithError("not a closed surface around the balls");
        return;
    }
    state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
    set_nodes(state, grid);
}
BENCHMARK(extract)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ellicast
