// tests/bench/large_models_bench.cpp: sender and receiver with hundreds of thousands to millions of
// vertices, and how much memory they take.
//
// Input: horse.ply of the reference models, or a torus where it is missing, enlarged to as many
// vertices as the argument says; a few thousand where ELLICAST_BENCH_SMALL asks for it. The label
// says which. Each row runs in a process of its own (fork), so that its peak of memory
// (VmHWM) is nobody else's; bytes_per_vertex counts all of that process but what it began with, and
// the receiver's records. The sender reads the file and makes all records, beside reading the file
// alone; the receiver has all records with 8-bit normals, and its mesh is checked: as promised,
// with all but a thousandth of the vertices. CGAL's advancing front has the same 700 000 points.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "receiver/reconstruction.hpp"
#include "sender/model_loading.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/large_model.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/rivals.hpp"
#include "tests/support/simulation.hpp"

namespace ellicast {
namespace {

// What a child tells of its work.
struct Outcome {
    double seconds = 0;
    double peak_bytes = 0;
    double vertices = 0;
    bool right = false;
};

// In bytes, from /proc.
double memory(const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind(key, 0) == 0) return 1024.0 * std::atof(line.c_str() + key.size() + 1);
    }
    return 0.0;
}

// Runs `work`, which tells the vertices and whether all is right, in a process of its own.
// `prepare` comes before and does not count.
Outcome in_child(const std::function<Outcome()>& work) {
    std::array<int, 2> ends{};
    Outcome outcome;
    malloc_trim(0);  // or the child would work in memory that it began with
    if (pipe(ends.data()) != 0) return outcome;
    const pid_t child = fork();
    if (child == 0) {
        std::ofstream("/proc/self/clear_refs") << "5";  // VmHWM begins anew
        const double before = memory("VmRSS:");
        const auto start = std::chrono::steady_clock::now();
        outcome = work();
        outcome.seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        outcome.peak_bytes += memory("VmHWM:") - before;
        const bool told = write(ends[1], &outcome, sizeof(outcome)) == sizeof(outcome);
        _exit(told ? 0 : 1);
    }
    close(ends[1]);
    if (child > 0) {
        const bool told = read(ends[0], &outcome, sizeof(outcome)) == sizeof(outcome);
        if (!told) outcome.right = false;
        waitpid(child, nullptr, 0);
    }
    close(ends[0]);
    return outcome;
}

struct Model {
    std::string name;
    std::filesystem::path path;
};

// The enlarged model as a file, made once.
const Model& model_of(std::size_t vertices) {
    static const tests::TemporaryDirectory directory;
    static std::map<std::size_t, Model> made;
    Model& model = made[vertices];
    if (model.path.empty()) {
        const bool small = std::getenv("ELLICAST_BENCH_SMALL") != nullptr;
        const auto folder = small ? std::nullopt : tests::models_dir();
        model.name = folder ? "horse, enlarged" : "torus, enlarged";
        model.path = directory.path() / (std::to_string(vertices) + ".ply");
        common::write_ply(model.path,
                          tests::large_model(folder ? common::read_model(*folder / "horse.ply")
                                                    : tests::torus(1.0, 0.3, 60, 30),
                                             small ? 5000 : vertices, 1));
    }
    return model;
}

const receiver::ReceivedObject& object_of(std::size_t vertices) {
    static std::map<std::size_t, receiver::ReceivedObject> received;
    receiver::ReceivedObject& object = received[vertices];
    if (object.vertices.empty()) {
        const sender::LoadedModel loaded = sender::load_model(model_of(vertices).path, {}, {});
        object = *tests::receive(tests::broadcast(loaded.object)).object;
    }
    return object;
}

// Each iteration is one child; seconds are those of the work alone.
void run(benchmark::State& state, const std::function<Outcome()>& work) {
    const auto vertices = static_cast<std::size_t>(state.range(0));
    double total = 0.0;
    Outcome outcome;
    for (auto _ : state) {
        outcome = in_child(work);
        state.SetIterationTime(outcome.seconds);
        total += outcome.vertices;
        if (!outcome.right) {
            state.SkipWithError("not the result that all records must give");
            return;
        }
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(total));
    state.counters["bytes_per_vertex"] = outcome.peak_bytes / outcome.vertices;
    state.SetLabel(model_of(vertices).name);
}

void read_file(benchmark::State& state) {
    const Model& model = model_of(static_cast<std::size_t>(state.range(0)));
    run(state, [&] {
        Outcome outcome;
        outcome.vertices = static_cast<double>(common::read_model(model.path).positions.size());
        outcome.right = outcome.vertices > 0;
        return outcome;
    });
}

void whole_sender(benchmark::State& state) {
    const Model& model = model_of(static_cast<std::size_t>(state.range(0)));
    run(state, [&] {
        const sender::LoadedModel loaded = sender::load_model(model.path, {}, {});
        Outcome outcome;
        outcome.vertices = static_cast<double>(loaded.object.vertices.size());
        outcome.right = !loaded.promise.approximate && outcome.vertices > 0;
        return outcome;
    });
}

void whole_receiver(benchmark::State& state) {
    const receiver::ReceivedObject& object = object_of(static_cast<std::size_t>(state.range(0)));
    run(state, [&] {
        const auto result = receiver::reconstruct(object);
        Outcome outcome;
        outcome.vertices = static_cast<double>(object.vertices.size());
        outcome.peak_bytes =
            outcome.vertices * (sizeof(protocol::VertexRecord) + sizeof(std::uint32_t));
        outcome.right = result && result->topology_as_promised &&
                        1000 * result->not_inserted.size() <= object.vertices.size();
        return outcome;
    });
}

// The same points, on one core, which is all it can use.
void rival_advancing_front(benchmark::State& state) {
    const std::vector<Eigen::Vector3d> points =
        tests::received_positions(object_of(static_cast<std::size_t>(state.range(0))));
    run(state, [&] {
        const common::TriangleMesh mesh = tests::advancing_front(points);
        const std::size_t left = points.size() - tests::positions_used(mesh);
        Outcome outcome;
        outcome.vertices = static_cast<double>(points.size());
        outcome.right = 1000 * left <= points.size();
        return outcome;
    });
}

// Once a repetition: they take seconds, and their spread is small.
BENCHMARK(read_file)->Arg(2'000'000)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(whole_sender)
    ->Arg(2'000'000)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(whole_receiver)
    ->Arg(700'000)
    ->Arg(2'000'000)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(rival_advancing_front)
    ->Arg(700'000)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ellicast
