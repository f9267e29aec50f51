// tests/tools/ring_check.cpp: how much of the original connectivity ring tags restore.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/loss_model.hpp"
#include "common/mesh_distance.hpp"
#include "common/model_io.hpp"
#include "tests/support/floor.hpp"
#include "tests/support/simulation.hpp"

namespace ellicast::tests {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

struct CheckOptions {
    std::vector<std::filesystem::path> models;
    std::optional<std::filesystem::path> cache;
    std::vector<double> losses{0.0, 0.1};
    unsigned seeds = 5;
    int normal_bits = 8;
    bool ring = true;
    bool with_floor = true;
    bool conceal = true;
};

// Original vertex -> record.
std::vector<std::uint32_t> records_of(const SimulatedModel& model) {
    std::map<std::array<float, 3>, std::uint32_t> record_at;
    const auto& vertices = model.loaded.object.vertices;
    for (std::uint32_t r = 0; r < vertices.size(); ++r) record_at[vertices[r].position] = r;
    const Eigen::Vector3d origin(model.loaded.object.description.origin.data());
    std::vector<std::uint32_t> records;
    for (const Eigen::Vector3d& p : model.original.positions) {
        const Eigen::Vector3f q = (p - origin).cast<float>();
        records.push_back(record_at.at({q.x(), q.y(), q.z()}));
    }
    return records;
}

std::vector<Edge> edges_of(const common::TriangleMesh& mesh,
                           const std::vector<std::uint32_t>& name) {
    std::vector<Edge> edges;
    for (const common::Triangle& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = name[t[k]];
            const std::uint32_t b = name[t[(k + 1) % 3]];
            if (a != receiver::kNotReceived && b != receiver::kNotReceived && a != b)
                edges.push_back(std::minmax(a, b));
        }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

// Of the original's edges between received vertices, the share that the result has.
double share_of_edges(const std::vector<Edge>& original, const std::vector<Edge>& result) {
    std::vector<Edge> both;
    std::set_intersection(original.begin(), original.end(), result.begin(), result.end(),
                          std::back_inserter(both));
    return static_cast<double>(both.size()) / static_cast<double>(original.size());
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values.empty() ? 0.0 : values[values.size() / 2];
}

void check(const std::filesystem::path& path, const CheckOptions& options) {
    const SimulatedModel model{
        common::read_model(path),
        sender::load_model(path, {}, options.cache,
                           {.normal_bits = options.normal_bits, .ring = options.ring})};
    const std::vector<TimedDatagram> stream = broadcast(model.loaded.object);
    const std::vector<std::uint32_t> record_of = records_of(model);
    for (const double loss : options.losses) {
        std::vector<double> shares, errors, floors, ratios, wrongs, seconds;
        for (unsigned seed = 1; seed <= (loss > 0.0 ? options.seeds : 1); ++seed) {
            common::LossSequence lost(common::BernoulliLoss{loss},
                                      common::stream_seed(seed, common::LossStream::drop));
            std::vector<TimedDatagram> arrived;
            for (const TimedDatagram& d : stream) {
                if (!lost.next_is_lost()) arrived.push_back(d);
            }
            const SimulatedReception reception = receive(arrived);
            double start = 0, rings = 0;
            receiver::ReconstructionOptions how;
            how.threads = 1;
            how.conceal = options.conceal;
            how.on_stage = [&](const std::string& stage) {
                if (start > 0) rings = cpu_seconds() - start;
                start = stage == "rings" ? cpu_seconds() : 0;
            };
            const auto result = receiver::reconstruct(*reception.object, how);
            seconds.push_back(rings);
            std::vector<bool> received(model.loaded.object.vertices.size(), false);
            for (const std::uint32_t r : reception.object->vertex_index) received[r] = true;
            std::vector<bool> kept;
            std::vector<std::uint32_t> name;
            for (const std::uint32_t r : record_of) {
                kept.push_back(received[r]);
                name.push_back(received[r] ? r : receiver::kNotReceived);
            }
            shares.push_back(share_of_edges(edges_of(model.original, name),
                                            edges_of(result->mesh, result->vertex_index)));
            errors.push_back(common::measure_distance(result->mesh, model.original).rms());
            wrongs.push_back(result->rings ? static_cast<double>(result->rings->disagree) : -1.0);
            if (options.with_floor && loss > 0.0) {
                floors.push_back(
                    common::measure_distance(collapse_onto(model.original, kept), model.original)
                        .rms());
                ratios.push_back(errors.back() / floors.back());
            }
            if (!result->topology_as_promised) std::printf("  topology wrong, seed %u\n", seed);
        }
        std::printf(
            "%-14s loss %.2f edges %.5f wrong %.0f of %zu rms %.3f floor %.3f ratio %.2f rings "
            "%.2f s\n",
            path.stem().c_str(), loss, median(shares), median(wrongs),
            model.loaded.object.vertices.size(), 1e4 * median(errors), 1e4 * median(floors),
            median(ratios), median(seconds));
        std::fflush(stdout);
    }
}

}  // namespace
}  // namespace ellicast::tests

int main(int argc, char** argv) {
    ellicast::tests::CheckOptions options;
    CLI::App app("Share of the original edges, rings that disagree, rms beside the floor");
    app.add_option("models", options.models)->required();
    app.add_option("--cache", options.cache);
    app.add_option("--loss", options.losses)->delimiter(',');
    app.add_option("--seeds", options.seeds);
    app.add_option("--normals", options.normal_bits);
    app.add_flag("!--no-ring", options.ring);
    app.add_flag("!--no-conceal", options.conceal);
    app.add_flag("!--no-floor", options.with_floor);
    CLI11_PARSE(app, argc, argv);
    for (const auto& path : options.models) ellicast::tests::check(path, options);
    return 0;
}
