// tests/bench/importance_order_bench.cpp: the order of importance beside OpenMesh's decimater.
//
// Input: horse.ply of the reference models, or a torus of as many vertices where they are missing,
// and the same enlarged; the label says which. The argument is the number of vertices. Ours takes
// the surface down to nothing; the decimater, which may not change the topology, to the four
// vertices of a tetrahedron or as far as it comes. It gets no enlarged ones: that takes minutes.
// Nothing is enlarged where ELLICAST_BENCH_SMALL asks for it.
#include <benchmark/benchmark.h>
// OpenMesh wants its mesh before the rest of it.
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "sender/surface_decimation.hpp"
#include "tests/support/large_model.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast {
namespace {

using common::TriangleMesh;

struct Input {
    std::string name;
    TriangleMesh model;
};

const Input& input_of(std::size_t vertices) {
    static std::map<std::size_t, Input> made;
    Input& input = made[vertices];
    if (!input.model.positions.empty()) return input;
    const bool small = std::getenv("ELLICAST_BENCH_SMALL") != nullptr;
    const auto folder = small ? std::nullopt : tests::models_dir();
    input = folder ? Input{"horse", common::read_model(*folder / "horse.ply")}
                   : Input{"torus, for want of horse.ply",
                           tests::torus(1.0, 0.3, small ? 62 : 310, small ? 31 : 155)};
    if (!small && vertices > input.model.positions.size()) {
        input.model = tests::large_model(input.model, vertices, 1);
        input.name += ", enlarged";
    }
    return input;
}

void importance_order(benchmark::State& state) {
    const Input& input = input_of(static_cast<std::size_t>(state.range(0)));
    std::vector<std::uint32_t> order;
    for (auto _ : state) order = sender::removal_order(input.model);
    std::sort(order.begin(), order.end());
    for (std::size_t v = 0; v < order.size(); ++v) {
        if (order[v] != v) state.SkipWithError("not every vertex once");
    }
    state.SetItemsProcessed(state.iterations() *
                            static_cast<std::int64_t>(input.model.positions.size()));
    state.SetLabel(input.name);
}

struct DoubleTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
};
using RivalMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

RivalMesh rival_mesh_of(const TriangleMesh& model) {
    RivalMesh mesh;
    mesh.reserve(model.positions.size(), 3 * model.positions.size(), model.triangles.size());
    for (const Eigen::Vector3d& p : model.positions) {
        mesh.add_vertex(RivalMesh::Point(p.x(), p.y(), p.z()));
    }
    const auto handle = [](std::uint32_t v) {
        return RivalMesh::VertexHandle(static_cast<int>(v));
    };
    for (const common::Triangle& t : model.triangles) {
        mesh.add_face(handle(t[0]), handle(t[1]), handle(t[2]));
    }
    return mesh;
}

// What OpenMesh's own example does: quadrics, half-edge collapses, the cheapest first.
void openmesh_decimater(benchmark::State& state) {
    const Input& input = input_of(static_cast<std::size_t>(state.range(0)));
    const RivalMesh original = rival_mesh_of(input.model);
    std::size_t collapses = 0;
    for (auto _ : state) {
        state.PauseTiming();
        RivalMesh mesh = original;
        state.ResumeTiming();
        OpenMesh::Decimater::DecimaterT<RivalMesh> decimater(mesh);
        OpenMesh::Decimater::ModQuadricT<RivalMesh>::Handle quadrics;
        decimater.add(quadrics);
        decimater.module(quadrics).unset_max_err();
        decimater.initialize();
        collapses = decimater.decimate_to(4);
    }
    if (collapses < input.model.positions.size() / 2) state.SkipWithError("hardly a collapse");
    state.counters["collapsed"] = static_cast<double>(collapses);
    state.SetItemsProcessed(state.iterations() *
                            static_cast<std::int64_t>(input.model.positions.size()));
    state.SetLabel(input.name);
}

BENCHMARK(importance_order)
    ->Arg(48'485)
    ->Arg(700'000)
    ->Arg(2'000'000)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(openmesh_decimater)->Arg(48'485)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ellicast
