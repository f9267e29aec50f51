// tests/bench/reconstruction_bench.cpp: the whole receiver beside CGAL's advancing front on the
// same points.
//
// Input: all records of horse.ply and stanford-bunny.ply of the reference models, without tags, or
// of a sphere of 10 thousand vertices where they are missing or ELLICAST_BENCH_SMALL asks for it;
// the label says which. Arguments: the model, and for the receiver the threads. items_per_second
// are vertices. The receiver's result is a closed manifold as promised that has all but a
// thousandth of the points for vertices; the rival's must use as many.
#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "receiver/reconstruction.hpp"
#include "sender/model_loading.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/rivals.hpp"
#include "tests/support/simulation.hpp"

namespace ellicast {
namespace {

struct Input {
    std::string name;
    receiver::ReceivedObject object;
};

Input load(std::size_t model) {
    constexpr std::array<const char*, 2> kModels = {"horse", "stanford-bunny"};
    const auto folder = tests::models_dir();
    const tests::TemporaryDirectory directory;
    std::filesystem::path path;
    std::string name = "sphere, for want of reference models";
    if (folder && !std::getenv("ELLICAST_BENCH_SMALL")) {
        name = kModels[model];
        path = *folder / (name + ".ply");
    } else {
        path = directory.path() / "sphere.ply";
        common::write_model(path, tests::icosphere(5));
    }
    const tests::SimulatedModel loaded = tests::load_simulated(path, {}, {.normal_bits = 0});
    return {name, *tests::receive(tests::broadcast(loaded.loaded.object)).object};
}

const Input& input(std::size_t model) {
    static std::array<std::optional<Input>, 2> inputs;
    if (!inputs[model]) inputs[model] = load(model);
    return *inputs[model];
}

void finish(benchmark::State& state, const Input& in) {
    state.SetItemsProcessed(state.iterations() *
                            static_cast<std::int64_t>(in.object.vertices.size()));
    state.SetLabel(in.name);
}

bool nearly_all(std::size_t used, const Input& in) {
    return used + in.object.vertices.size() / 1000 >= in.object.vertices.size();
}

void whole_receiver(benchmark::State& state) {
    const Input& in = input(static_cast<std::size_t>(state.range(0)));
    receiver::ReconstructionOptions options;
    options.threads = static_cast<unsigned>(state.range(1));
    std::optional<receiver::Reconstruction> result;
    for (auto _ : state) result = receiver::reconstruct(in.object, options);
    if (!result || !result->topology_as_promised ||
        !nearly_all(in.object.vertices.size() - result->not_inserted.size(), in)) {
        state.SkipWithError("not the promised surface of all points");
        return;
    }
    finish(state, in);
}

void rival_advancing_front(benchmark::State& state) {
    const Input& in = input(static_cast<std::size_t>(state.range(0)));
    const std::vector<Eigen::Vector3d> points = tests::received_positions(in.object);
    common::TriangleMesh mesh;
    for (auto _ : state) mesh = tests::advancing_front(points);
    if (!nearly_all(tests::positions_used(mesh), in)) {
        state.SkipWithError("points left out");
        return;
    }
    finish(state, in);
}

BENCHMARK(whole_receiver)
    ->Args({0, 1})
    ->Args({0, 2})
    ->Args({1, 1})
    ->Args({1, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(rival_advancing_front)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace ellicast
