// tests/bench/ellipsoid_growth_bench.cpp: growth by the tree against a plain scan, and selection.
//
// Input: horse.ply of the reference models, or a torus of 48 thousand vertices where they are
// missing; the label says which. One thread. The first argument is the number of seeds.
// items_per_second are seeds, so that the ratio of two rows is the speed-up, whatever their numbers
// of seeds; a scan over all seeds would take a minute.
#include <benchmark/benchmark.h>

#include <optional>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "sender/decomposition.hpp"
#include "sender/ellipsoid_growth.hpp"
#include "sender/surface_samples.hpp"
#include "sender/surface_smoothing.hpp"
#include "sender/unit_frame.hpp"
#include "tests/sender/constraint_scan.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast {
namespace {

using common::Ellipsoid;
using common::TriangleMesh;

struct Input {
    std::string name;
    TriangleMesh model;
};

const Input& input() {
    static const Input kInput = [] {
        const auto folder = tests::models_dir();
        if (folder) return Input{"horse", common::read_model(*folder / "horse.ply")};
        return Input{"torus, for want of horse.ply", tests::torus(1.0, 0.3, 310, 155)};
    }();
    return kInput;
}

sender::DecompositionOptions options_of(const benchmark::State& state) {
    sender::DecompositionOptions options;
    options.candidates = static_cast<std::size_t>(state.range(0));
    options.threads = 1;
    return options;
}

// The vertices as constraints, smoothed as grow_candidates does it.
struct Surface {
    TriangleMesh smoothed;
    std::vector<Eigen::Vector3d> original;
};

Surface surface() {
    const TriangleMesh unit = sender::UnitFrame(input().model.positions).to_unit(input().model);
    const int steps = sender::default_smoothing_steps(unit);
    return {{sender::smoothed_positions(unit, steps), unit.triangles}, unit.positions};
}

std::optional<Ellipsoid> grow_by_scan(const sender::SurfaceSamples& seeds, std::size_t i,
                                      const tests::ConstraintScan& smoothed,
                                      const tests::ConstraintScan& original) {
    sender::GrowthContacts contacts;
    const sender::DecompositionOptions defaults;
    sender::GrowthOptions options;
    options.epsilon = defaults.epsilon;
    options.max_aspect = defaults.max_aspect;
    return sender::grow_ellipsoid({seeds.points[i], seeds.inward[i]}, smoothed, original, options,
                                  contacts);
}

bool equal(const std::optional<Ellipsoid>& a, const std::optional<Ellipsoid>& b) {
    if (!a || !b) return a.has_value() == b.has_value();
    return a->center == b->center && a->L == b->L;
}

// What grow_ellipsoid costs when every question scans all points.
void plain_scan(benchmark::State& state) {
    const Surface where = surface();
    const auto count = static_cast<std::size_t>(state.range(0));
    const sender::SurfaceSamples seeds = sender::place_seeds(where.smoothed, count, 1);
    const tests::ConstraintScan smoothed({where.smoothed.positions, {}});
    const tests::ConstraintScan original({where.original, {}});
    // The same by the tree, first: to the bit.
    const sender::ConstraintTree tree({where.smoothed.positions, {}});
    const sender::ConstraintTree original_tree({where.original, {}}, tree);
    sender::GrowthOptions options;
    options.epsilon = sender::DecompositionOptions{}.epsilon;
    sender::GrowthContacts warm;
    for (std::size_t i = 0; i < seeds.points.size(); ++i) {
        const auto by_tree = sender::grow_ellipsoid({seeds.points[i], seeds.inward[i]}, tree,
                                                    original_tree, options, warm);
        if (!equal(by_tree, grow_by_scan(seeds, i, smoothed, original))) {
            state.SkipWithError("tree and scan disagree");
            return;
        }
    }
    for (auto _ : state) {
        for (std::size_t i = 0; i < seeds.points.size(); ++i) {
            benchmark::DoNotOptimize(grow_by_scan(seeds, i, smoothed, original));
        }
    }
    state.SetItemsProcessed(state.iterations() * state.range(0));
    state.SetLabel(input().name);
}
BENCHMARK(plain_scan)->Arg(200)->Unit(benchmark::kMillisecond);

// Smoothing, seeds, trees, growth: all that grow_candidates does.
void grow_by_tree(benchmark::State& state) {
    const sender::DecompositionOptions options = options_of(state);
    std::size_t grown = 0;
    for (auto _ : state) grown = sender::grow_candidates(input().model, options).size();
    if (static_cast<double>(grown) < 0.9 * static_cast<double>(options.candidates)) {
        state.SkipWithError("hardly a seed grew");
        return;
    }
    state.SetItemsProcessed(state.iterations() * state.range(0));
    state.SetLabel(input().name);
}
BENCHMARK(grow_by_tree)->Arg(2'500)->Arg(10'000)->Arg(48'485)->Unit(benchmark::kMillisecond);

// Voxels of the solid and 400 picks as they grew; arguments: candidates, cells, 1 for the robust
// criterion.
void selection(benchmark::State& state) {
    sender::DecompositionOptions options = options_of(state);
    options.grid = static_cast<int>(state.range(1));
    options.refine = 0;
    options.criterion = state.range(2) != 0 ? sender::Criterion::robust : sender::Criterion::volume;
    const std::vector<Ellipsoid> candidates = sender::grow_candidates(input().model, options);
    sender::Decomposition chosen;
    for (auto _ : state) {
        chosen = sender::select_ellipsoids(candidates, input().model, options);
    }
    if (chosen.ellipsoids.size() != options.ellipsoids || chosen.covered < 0.95) {
        state.SkipWithError("the selection covers too little");
        return;
    }
    state.counters["covered"] = chosen.covered;
    state.SetLabel(input().name);
}
BENCHMARK(selection)
    ->Args({2'500, 100, 0})
    ->Args({2'500, 100, 1})
    ->Args({2'500, 128, 1})
    ->Args({10'000, 128, 1})
    ->Unit(benchmark::kMillisecond);

// Both, as the paper's half an hour on 100^3 was; arguments: candidates, cells.
void growth_and_selection(benchmark::State& state) {
    sender::DecompositionOptions options = options_of(state);
    options.grid = static_cast<int>(state.range(1));
    options.refine = 0;
    sender::Decomposition chosen;
    for (auto _ : state) chosen = sender::decompose(input().model, options);
    if (chosen.ellipsoids.size() != options.ellipsoids || chosen.covered < 0.95) {
        state.SkipWithError("the decomposition covers too little");
        return;
    }
    state.counters["covered"] = chosen.covered;
    state.SetLabel(input().name);
}
BENCHMARK(growth_and_selection)->Args({2'500, 128})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ellicast
