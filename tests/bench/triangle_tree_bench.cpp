// tests/bench/triangle_tree_bench.cpp: closest points by the tree against brute force.
#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/random.hpp"
#include "common/triangle_tree.hpp"
#include "tests/support/meshes.hpp"

namespace {

using namespace ellicast::common;
using Eigen::Vector3d;

// Points at distances of 1e-4 to 1e-1 of the radius from the surface, in the order of their
// triangles, as a distance between meshes asks for them.
std::vector<Vector3d> queries_near(const TriangleMesh& mesh, std::size_t count) {
    Random random(1);
    std::vector<Vector3d> queries;
    for (const SurfaceSample& s : sample_surface(mesh, count, 1)) {
        const double off = 1e-4 + 0.1 * random.uniform() * random.uniform() * random.uniform();
        queries.push_back((random.chance(0.5) ? 1.0 + off : 1.0 - off) * s.point);
    }
    return queries;
}

TriangleTree::Hit brute_force(const TriangleMesh& mesh, const Vector3d& x) {
    TriangleTree::Hit best;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& [a, b, c] = mesh.triangles[i];
        const TrianglePoint hit =
            closest_point_on_triangle(x, mesh.positions[a], mesh.positions[b], mesh.positions[c]);
        const double d2 = (x - hit.point).squaredNorm();
        if (d2 < best.squared_distance) {
            best = {static_cast<std::uint32_t>(i), hit.point, hit.barycentric, d2};
        }
    }
    return best;
}

void require_agreement(const TriangleMesh& mesh, const TriangleTree& tree,
                       const std::vector<Vector3d>& queries) {
    for (std::size_t q = 0; q < queries.size(); q += queries.size() / 20) {
        const TriangleTree::Hit a = tree.closest(queries[q]);
        const TriangleTree::Hit b = brute_force(mesh, queries[q]);
        if (a.triangle != b.triangle || a.point != b.point) {
            throw std::logic_error("the tree and brute force disagree");
        }
    }
}

void build(benchmark::State& state) {
    const TriangleMesh mesh = ellicast::tests::icosphere(static_cast<int>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(TriangleTree(mesh));
    state.counters["triangles/s"] = benchmark::Counter(
        static_cast<double>(mesh.triangles.size()), benchmark::Counter::kIsIterationInvariantRate);
}

void query_tree(benchmark::State& state) {
    const TriangleMesh mesh = ellicast::tests::icosphere(static_cast<int>(state.range(0)));
    const TriangleTree tree(mesh);
    const std::vector<Vector3d> queries = queries_near(mesh, 20'000);
    require_agreement(mesh, tree, queries);
    for (auto _ : state) {
        for (const Vector3d& x : queries) benchmark::DoNotOptimize(tree.closest(x));
    }
    state.counters["queries/s"] = benchmark::Counter(static_cast<double>(queries.size()),
                                                     benchmark::Counter::kIsIterationInvariantRate);
}

void query_brute_force(benchmark::State& state) {
    const TriangleMesh mesh = ellicast::tests::icosphere(static_cast<int>(state.range(0)));
    const std::vector<Vector3d> queries = queries_near(mesh, 20);
    for (auto _ : state) {
        for (const Vector3d& x : queries) benchmark::DoNotOptimize(brute_force(mesh, x));
    }
    state.counters["queries/s"] = benchmark::Counter(static_cast<double>(queries.size()),
                                                     benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace

// 1 280, 20 480 and 327 680 triangles.
BENCHMARK(build)->Arg(3)->Arg(5)->Arg(7)->Unit(benchmark::kMillisecond);
BENCHMARK(query_tree)->Arg(3)->Arg(5)->Arg(7)->Unit(benchmark::kMillisecond);
BENCHMARK(query_brute_force)->Arg(3)->Arg(5)->Arg(7)->Unit(benchmark::kMillisecond);
