// tests/tools/loss_sweep.cpp: error and topology against loss, ours beside CGAL's advancing front.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "receiver/reconstruction.hpp"
#include "tests/support/simulation.hpp"
#ifdef ELLICAST_WITH_CGAL
#include "tests/support/rivals.hpp"
#endif

namespace ellicast::tests {
namespace {

struct Options {
    std::vector<std::filesystem::path> models;
    std::vector<double> losses{0, 0.1, 0.3, 0.5, 0.7, 0.9};
    unsigned seeds = 3;
    std::filesystem::path out = "loss-sweep";
    sender::DecompositionOptions decomposition;
    double burst = 0;  // mean length; 0: independent losses
    unsigned threads = 0;
};

/// One run of one method.
struct Row {
    std::string method;
    std::size_t vertices = 0;
    std::size_t ellipsoids = 0;
    std::uint64_t bytes = 0;
    common::MeshTopology topology;
    std::optional<common::MeshDistance> distance;  // empty: no surface
    bool topology_right = false;
    std::size_t not_inserted = 0;
    double cpu_seconds = 0;
};

constexpr const char* kColumns =
    "model,loss,seed,method,vertices_received,ellipsoids_received,bytes,rms,rms_to,rms_from,mean,"
    "max,normal_deg,components,genus,closed,manifold,topology_right,not_inserted,cpu_seconds";

std::string text_of(double value) {
    if (!std::isfinite(value)) return "nan";
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

std::string line_of(const std::string& model, double loss, unsigned seed, const Row& row) {
    common::MeshDistance d;
    if (row.distance) {
        d = *row.distance;
    } else {
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        d = {kNone, kNone, kNone, kNone, kNone, kNone};
    }
    std::string line = model + "," + text_of(loss) + "," + std::to_string(seed) + "," + row.method;
    for (const std::uint64_t count :
         {std::uint64_t{row.vertices}, std::uint64_t{row.ellipsoids}, row.bytes}) {
        line += "," + std::to_string(count);
    }
    for (const double value :
         {d.rms(), d.rms_to_reference, d.rms_from_reference, d.mean(), d.max, d.normal_deg}) {
        line += "," + text_of(value);
    }
    line += "," + std::to_string(row.topology.components);
    line += "," + std::to_string(row.topology.components > 0 ? row.topology.genus() : 0);
    for (const bool fact : {row.topology.closed, row.topology.manifold, row.topology_right}) {
        line += fact ? ",1" : ",0";
    }
    return line + "," + std::to_string(row.not_inserted) + "," + text_of(row.cpu_seconds);
}

/// Judges a surface against the original and what the sender promised of it.
void judge(const common::TriangleMesh& mesh, const SimulatedModel& model, unsigned threads,
           Row& row) {
    row.topology = common::analyse_topology(mesh);
    row.topology_right = is_as_hinted(row.topology, model.loaded.object.hint);
    if (!mesh.triangles.empty()) {
        row.distance = common::measure_distance(mesh, model.original, {.threads = threads});
    }
}

Row run_ellicast(const SimulatedModel& model, const receiver::ReceivedObject& object,
                 unsigned threads, const Row& received) {
    Row row = received;
    row.method = "ellicast";
    receiver::ReconstructionOptions how;
    how.threads = threads;
    const double start = cpu_seconds();
    const auto result = receiver::reconstruct(object, how);
    row.cpu_seconds = cpu_seconds() - start;
    row.not_inserted = result ? result->not_inserted.size() : object.vertices.size();
    if (result) judge(result->mesh, model, threads, row);
    return row;
}

#ifdef ELLICAST_WITH_CGAL
Row run_advancing_front(const SimulatedModel& model, const receiver::ReceivedObject& object,
                        unsigned threads, const Row& received) {
    Row row = received;
    row.method = "advancing-front";
    row.ellipsoids = 0;  // it has no use for them
    const double start = cpu_seconds();
    common::TriangleMesh mesh = advancing_front(received_positions(object));
    row.cpu_seconds = cpu_seconds() - start;
    // Which way it faces is left to chance; that is not held against it.
    if (common::signed_volume(mesh) < 0) {
        for (common::Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    }
    judge(mesh, model, threads, row);
    row.not_inserted = object.vertices.size() - row.topology.vertices;
    return row;
}
#endif

/// All methods on what one seeded loss leaves.
std::vector<Row> run(const SimulatedModel& model, double loss, unsigned seed,
                     const Options& options) {
    BroadcastOptions how;
    how.impairment.seed = seed;
    if (options.burst > 0) {
        how.impairment.loss = bursty_loss(loss, options.burst);
    } else {
        how.impairment.drop = loss;
    }
    const SimulatedReception reception = receive(broadcast(model.loaded.object, how));
    receiver::ReceivedObject object;
    if (reception.object) object = *reception.object;
    Row received;
    received.vertices = object.vertices.size();
    received.ellipsoids = object.ellipsoids.size();
    received.bytes = reception.summary.datagrams.bytes;

    std::vector<Row> rows{run_ellicast(model, object, options.threads, received)};
#ifdef ELLICAST_WITH_CGAL
    rows.push_back(run_advancing_front(model, object, options.threads, received));
#endif
    return rows;
}

void sweep(const std::filesystem::path& path, const Options& options, std::ofstream& csv) {
    const std::string name = path.stem().string();
    const SimulatedModel model = load_simulated(path, options.decomposition);
    for (const std::string& warning : model.loaded.warnings) {
        std::fprintf(stderr, "%s: %s\n", name.c_str(), warning.c_str());
    }
    for (const double loss : options.losses) {
        for (unsigned seed = 1; seed <= options.seeds; ++seed) {
            for (const Row& row : run(model, loss, seed, options)) {
                csv << line_of(name, loss, seed, row) << std::endl;
                std::fprintf(stderr, "%s, loss %g, seed %u, %s: rms %.2e, max %.2e, topology %s\n",
                             name.c_str(), loss, seed, row.method.c_str(),
                             row.distance ? row.distance->rms() : NAN,
                             row.distance ? row.distance->max : NAN,
                             row.topology_right ? "right" : "wrong");
            }
        }
    }
}

void add_options(CLI::App& app, Options& options) {
    app.add_option("MODEL", options.models, "Model files")->required()->check(CLI::ExistingFile);
    app.add_option("--loss", options.losses, "Shares of datagrams lost, with commas between")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    app.add_option("--seeds", options.seeds, "Loss seeds 1 to K")
        ->check(CLI::Range(1u, 10'000u))
        ->capture_default_str();
    app.add_option("--out", options.out, "Directory for loss-sweep.csv")->capture_default_str();
    app.add_option("--ellipsoids", options.decomposition.ellipsoids)
        ->check(CLI::Range(std::size_t{1}, std::size_t{protocol::kMaxEllipsoids}))
        ->capture_default_str();
    app.add_option("--candidates", options.decomposition.candidates)
        ->check(CLI::Range(std::size_t{1}, std::size_t{10'000'000}))
        ->capture_default_str();
    app.add_option("--burst", options.burst, "Lose in bursts of this mean length")
        ->check(CLI::Range(1.0, 1e6));
    app.add_option("--threads", options.threads, "0: one per core")->check(CLI::Range(0u, 1024u));
}

void run_all(const Options& options) {
    std::filesystem::create_directories(options.out);
    const std::filesystem::path path = options.out / "loss-sweep.csv";
    std::ofstream csv(path);
    csv << kColumns << std::endl;
    for (const std::filesystem::path& model : options.models) sweep(model, options, csv);
    if (!csv) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace
}  // namespace ellicast::tests

int main(int argc, char** argv) {
    ellicast::tests::Options options;
    CLI::App app("Runs the pair in one process over loss x seed and writes a table.", "loss_sweep");
    ellicast::tests::add_options(app, options);
    try {
        app.parse(argc, argv);
        options.decomposition.threads = options.threads;
        if (options.burst > 0) {  // refuse what cannot be before the work
            for (const double loss : options.losses) {
                ellicast::tests::bursty_loss(loss, options.burst);
            }
        }
        ellicast::tests::run_all(options);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "loss_sweep: %s\n", error.what());
        return 2;
    }
    return 0;
}
