// tests/tools/coarse_sweep.cpp: what the ellipsoids alone show of a model, and how loss harms it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/coarse_surface.hpp"
#include "common/distance_grid.hpp"
#include "common/marching_cubes.hpp"
#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/random.hpp"
#include "common/solid_voxels.hpp"
#include "sender/decomposition.hpp"
#include "sender/ellipsoid_refinement.hpp"
#include "sender/model_preparation.hpp"

namespace ellicast {
namespace {

double cpu() {
    std::timespec t{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void blur(const common::GridFrame& frame, std::vector<float>& field) {
    const std::array<std::size_t, 3> stride = {
        1, static_cast<std::size_t>(frame.dims[0]),
        static_cast<std::size_t>(frame.dims[0]) * static_cast<std::size_t>(frame.dims[1])};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::vector<float> old = field;
        const std::size_t s = stride[axis];
        for (std::size_t v = s; v + s < old.size(); ++v) {
            field[v] = 0.25f * old[v - s] + 0.5f * old[v] + 0.25f * old[v + s];
        }
    }
}

struct Options {
    std::vector<std::filesystem::path> models;
    std::vector<std::size_t> counts{100, 200, 400};
    int draws = 10;
    sender::DecompositionOptions decomposition;
    sender::RefinementOptions refine;
    bool by_volume = false;
    bool levels = false;
    int blur = 0;
};

void run(const Options& o) {
    for (const auto& path : o.models) {
        const auto model = sender::prepare_model(common::read_model(path));
        const auto& solid = model.solid;
        const auto box = common::bounding_box(solid.positions);
        const auto promise = sender::promise_topology(model, 2);
        const common::PromisedTopology promised{promise.components, promise.euler_all,
                                                promise.euler_largest};
        double t0 = cpu();
        const auto candidates = sender::grow_candidates(solid, o.decomposition);
        const double grow = cpu() - t0;
        for (const std::size_t count : o.counts) {
            auto d = o.decomposition;
            d.refine = 0;
            d.ellipsoids = count;
            if (o.by_volume) d.criterion = sender::Criterion::volume;
            t0 = cpu();
            auto chosen = sender::select_ellipsoids(candidates, solid, d).ellipsoids;
            const double select = cpu() - t0;
            t0 = cpu();
            if (o.refine.rounds > 0) chosen = sender::refine_ellipsoids(chosen, solid, o.refine);
            const double refine = cpu() - t0;
            const auto all = common::make_coarse_surface({chosen, {}, {}, box}, promised, 96, 2);
            std::printf("%-15s %4zu grow %.2f sel %.2f ref %.2f  IoU %.4f lvl %.2f %s",
                        path.stem().c_str(), chosen.size(), grow, select, refine,
                        all ? common::volume_overlap(all->mesh, solid) : 0.0,
                        all ? all->isolevel / all->cell : 0.0,
                        all && all->as_promised ? "ok" : "WRONG");
            if (o.levels) {
                const auto frame = common::make_grid_frame(box, 96, 4);
                auto grid = common::make_distance_grid(chosen, frame, 2);
                for (int b = 0; b < o.blur; ++b) blur(frame, grid.values);
                for (double level : {0.0, 0.125, 0.25, 0.375, 0.5, 0.75, 1.0}) {
                    const auto mesh = common::marching_cubes(
                        frame, grid.values, static_cast<float>(level * frame.spacing), 2);
                    const auto topology = common::analyse_topology(mesh);
                    std::printf(" [%.3f: %.4f %zu c %ld %ld]", level,
                                level < .4 ? common::volume_overlap(mesh, solid, 128) : 0.0,
                                topology.components, static_cast<long>(topology.euler),
                                static_cast<long>(topology.euler_largest));
                }
            }
            for (const double loss : {0.03, 0.125, 0.343}) {
                int right = 0;
                double overlap = 0;
                for (int s = 0; s < o.draws; ++s) {
                    common::Random random(1000 + static_cast<std::uint64_t>(s));
                    std::vector<common::Ellipsoid> left;
                    for (const auto& e : chosen) {
                        if (!random.chance(loss)) left.push_back(e);
                    }
                    const auto m =
                        common::make_coarse_surface({left, {}, {}, box}, promised, 96, 2);
                    right += m && m->as_promised;
                    if (s < 2 && m) overlap += common::volume_overlap(m->mesh, solid, 128) / 2;
                }
                std::printf(" | %.3f: %d/%d %.3f", loss, right, o.draws, overlap);
            }
            std::printf("\n");
            std::fflush(stdout);
        }
    }
}

}  // namespace
}  // namespace ellicast

int main(int argc, char** argv) {
    ellicast::Options o;
    CLI::App app("Coarse shapes.");
    app.add_option("MODEL", o.models)->required();
    app.add_option("--counts", o.counts)->delimiter(',');
    app.add_option("--draws", o.draws);
    app.add_option("--rounds", o.refine.rounds);
    app.add_option("--loss", o.refine.loss);
    app.add_option("--isolevel", o.refine.isolevel);
    app.add_option("--grid", o.refine.grid);
    app.add_option("--select-loss", o.decomposition.expected_loss);
    app.add_option("--candidates", o.decomposition.candidates);
    app.add_option("--blur", o.blur);
    app.add_flag("--levels", o.levels);
    app.add_flag("--volume", o.by_volume);
    CLI11_PARSE(app, argc, argv);
    try {
        ellicast::run(o);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 2;
    }
}
