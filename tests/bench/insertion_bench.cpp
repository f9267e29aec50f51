// tests/bench/insertion_bench.cpp: vertex insertion, edge flips and the search for
// self-intersections.
//
// Input: the vertices of horse.ply of the reference models, or of a torus where it is missing,
// enlarged to as many as the argument says (a few thousand where ELLICAST_BENCH_SMALL asks for it);
// the coarse surface is the model decimated to 12 000 or a quarter. One thread. items_per_second
// are vertices. Insertion is to be flat in the number of vertices; flips stand beside one look at
// every edge, self-intersection beside a look at all pairs of triangles of a small part.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "common/self_intersection.hpp"
#include "common/triangle_intersection.hpp"
#include "receiver/edge_flips.hpp"
#include "receiver/surface_smoothing.hpp"
#include "receiver/vertex_insertion.hpp"
#include "sender/surface_decimation.hpp"
#include "tests/support/large_model.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast {
namespace {

using common::TriangleMesh;

constexpr std::size_t kCoarseVertices = 12'000;

struct Input {
    std::string name;
    TriangleMesh model;
    TriangleMesh coarse;
    std::vector<std::uint32_t> order;  // in which the points come: scattered, as from a network
};

// The model on every so-manieth vertex of its order of importance.
TriangleMesh decimated(const TriangleMesh& model, std::size_t vertices) {
    std::vector<std::uint32_t> removed = sender::removal_order(model);
    std::vector<bool> keep(model.positions.size(), false);
    for (std::size_t k = 0; k < std::min(vertices, removed.size()); ++k) {
        keep[removed[removed.size() - 1 - k]] = true;
    }
    const TriangleMesh collapsed = sender::collapsed_onto(model, keep);
    TriangleMesh result;
    constexpr std::uint32_t kUnused = 0xffffffffU;
    std::vector<std::uint32_t> number(collapsed.positions.size(), kUnused);
    for (common::Triangle t : collapsed.triangles) {
        for (std::uint32_t& v : t) {
            if (number[v] == kUnused) {
                number[v] = static_cast<std::uint32_t>(result.positions.size());
                result.positions.push_back(collapsed.positions[v]);
            }
            v = number[v];
        }
        result.triangles.push_back(t);
    }
    return result;
}

const Input& input_of(std::size_t vertices) {
    static std::map<std::size_t, Input> made;
    Input& input = made[vertices];
    if (!input.model.positions.empty()) return input;
    const bool small = std::getenv("ELLICAST_BENCH_SMALL") != nullptr;
    const auto folder = small ? std::nullopt : tests::models_dir();
    const TriangleMesh model =
        folder ? common::read_model(*folder / "horse.ply") : tests::torus(1.0, 0.3, 60, 30);
    const std::size_t size = small ? 5000 : vertices;
    const bool enlarged = size > model.positions.size();
    input.model = enlarged ? tests::large_model(model, size, 1) : model;
    input.name = std::string(folder ? "horse" : "torus") + (enlarged ? ", enlarged" : "");
    input.coarse =
        decimated(input.model, std::min(kCoarseVertices, input.model.positions.size() / 4));
    // A stride that shares no factor with the number visits all of them, scattered.
    const std::size_t n = input.model.positions.size();
    std::size_t stride = n * 5 / 8;
    while (std::gcd(stride, n) != 1) ++stride;
    for (std::size_t k = 0; k < n; ++k) {
        input.order.push_back(static_cast<std::uint32_t>(k * stride % n));
    }
    return input;
}

receiver::PointSurface coarse_surface(const Input& input) {
    receiver::PointSurface surface;
    surface.mesh = *receiver::SurfaceMesh::from(input.coarse);
    surface.point_of_vertex.assign(surface.mesh.vertex_slots(), receiver::kNone);
    return surface;
}

void finish(benchmark::State& state, const Input& input) {
    state.SetItemsProcessed(state.iterations() *
                            static_cast<std::int64_t>(input.model.positions.size()));
    state.SetLabel(input.name);
}

// Projection, split and flips.
void insert(benchmark::State& state) {
    const Input& input = input_of(static_cast<std::size_t>(state.range(0)));
    receiver::PointSurface surface;
    std::size_t left_out = 0;
    for (auto _ : state) {
        state.PauseTiming();
        surface = coarse_surface(input);
        state.ResumeTiming();
        left_out = receiver::insert_points(surface, input.model.positions, input.order, 1).size();
    }
    // Corners of the coarse surface are vertices of the model; where a point cannot move one it may
    // be left out.
    if (!surface.mesh.validate().empty() || left_out > input.coarse.positions.size()) {
        state.SkipWithError("not a surface through the points");
        return;
    }
    finish(state, input);
}

// The model, whose edges are first turned to Delaunay so that there is something to smooth.
void smooth(benchmark::State& state) {
    const Input& input = input_of(static_cast<std::size_t>(state.range(0)));
    receiver::SurfaceMesh delaunay = *receiver::SurfaceMesh::from(input.model);
    receiver::flip_all_to_delaunay(delaunay, 1);
    receiver::SurfaceMesh mesh;
    std::size_t flips = 0;
    for (auto _ : state) {
        state.PauseTiming();
        mesh = delaunay;
        state.ResumeTiming();
        flips = receiver::flip_to_smooth(mesh, {}, receiver::SurfaceSmoother::kPasses, 1);
    }
    if (flips == 0 || !mesh.validate().empty()) {
        state.SkipWithError("no flip, or no surface any more");
        return;
    }
    finish(state, input);
}

// Every edge of the mesh read once: its four vertices and their distances.
void look_at_edges(benchmark::State& state) {
    const Input& input = input_of(static_cast<std::size_t>(state.range(0)));
    const receiver::SurfaceMesh mesh = *receiver::SurfaceMesh::from(input.model);
    for (auto _ : state) {
        double sum = 0.0;
        for (receiver::HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
            if (h > mesh.twin(h)) continue;
            const Eigen::Vector3d& c = mesh.position(mesh.opposite(h));
            const Eigen::Vector3d& d = mesh.position(mesh.opposite(mesh.twin(h)));
            const Eigen::Vector3d& a = mesh.position(mesh.from_vertex(h));
            const Eigen::Vector3d& b = mesh.position(mesh.to_vertex(h));
            sum += (a - b).norm() - (c - d).norm();
        }
        benchmark::DoNotOptimize(sum);
    }
    finish(state, input);
}

// Triangles pushed through each other, so that there is something to find.
TriangleMesh crumpled(const Input& input, std::size_t triangles) {
    TriangleMesh mesh = input.model;
    mesh.triangles.resize(std::min(triangles, mesh.triangles.size()));
    const double length = common::mean_edge_length(input.model);
    for (std::size_t v = 0; v < mesh.positions.size(); v += 50) {
        mesh.positions[v] += Eigen::Vector3d::Constant(2.0 * length);
    }
    return mesh;
}

constexpr std::size_t kFewTriangles = 2000;

std::size_t plain_pairs(const TriangleMesh& mesh) {
    std::size_t pairs = 0;
    const auto corners = [&](const common::Triangle& t) -> common::TriangleCorners {
        return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    };
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        const common::Triangle& s = mesh.triangles[f];
        for (std::size_t g = f + 1; g < mesh.triangles.size(); ++g) {
            const common::Triangle& t = mesh.triangles[g];
            const bool share =
                std::find_first_of(s.begin(), s.end(), t.begin(), t.end()) != s.end();
            if (!share && common::triangles_meet(corners(s), corners(t))) ++pairs;
        }
    }
    return pairs;
}

void count_items(benchmark::State& state, const TriangleMesh& mesh, const Input& input) {
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.triangles.size()));
    state.SetLabel(input.name);
}

void self_intersections(benchmark::State& state) {
    const Input& input = input_of(48'485);
    const TriangleMesh few = crumpled(input, kFewTriangles);
    if (common::count_self_intersections(few, 1).pairs != plain_pairs(few)) {
        state.SkipWithError("not the pairs that looking at all of them finds");
        return;
    }
    const TriangleMesh mesh = crumpled(input, input.model.triangles.size());
    std::size_t pairs = 0;
    for (auto _ : state) pairs = common::count_self_intersections(mesh, 1).pairs;
    state.counters["pairs"] = static_cast<double>(pairs);
    count_items(state, mesh, input);
}

void all_pairs(benchmark::State& state) {
    const Input& input = input_of(48'485);
    const TriangleMesh few = crumpled(input, kFewTriangles);
    for (auto _ : state) benchmark::DoNotOptimize(plain_pairs(few));
    count_items(state, few, input);
}

BENCHMARK(insert)->Arg(48'485)->Arg(200'000)->Arg(700'000)->Unit(benchmark::kMillisecond);
BENCHMARK(smooth)->Arg(48'485)->Arg(700'000)->Unit(benchmark::kMillisecond);
BENCHMARK(look_at_edges)->Arg(48'485)->Arg(700'000)->Unit(benchmark::kMillisecond);
BENCHMARK(self_intersections)->Unit(benchmark::kMillisecond);
BENCHMARK(all_pairs)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ellicast
