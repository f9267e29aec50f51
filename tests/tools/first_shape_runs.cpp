// tests/tools/first_shape_runs.cpp
#include "tests/tools/first_shape_runs.hpp"

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <thread>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/random.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/made_network.hpp"
#ifdef ELLICAST_WITH_DRACO
#include "tests/support/draco_rival.hpp"
#endif

namespace ellicast::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using namespace std::chrono_literals;
using Words = std::vector<std::string>;
using Process = std::unique_ptr<ChildProcess>;

constexpr const char* kGroup = "239.255.77.1";
constexpr auto kPatience = 120s;              // for the end of a program
constexpr auto kMidwayListening = 2500ms;     // a few rounds of the models meant
constexpr const char* kRivalListening = "5";  // seconds
constexpr std::size_t kRoundsReceivers = 8;
constexpr int kMostRounds = 3;

Process start_in(const std::string& space, const Words& words) {
    return std::make_unique<ChildProcess>("/usr/bin/env", MadeNetwork::inside(space, words));
}

void require(bool is_so, const std::string& complaint) {
    if (!is_so) throw std::runtime_error(complaint);
}

void write_bytes(const fs::path& path, std::span<const char> bytes) {
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) throw common::ModelError("cannot write '" + path.string() + "'");
}

/// Positions alone, as a stream of raw vertices has them.
std::vector<char> raw_vertices(const common::TriangleMesh& mesh) {
    std::vector<float> numbers;
    for (const Eigen::Vector3d& p : mesh.positions) {
        for (const double x : p) numbers.push_back(static_cast<float>(x));
    }
    const auto bytes = std::as_bytes(std::span(numbers));
    const auto* const first = reinterpret_cast<const char*>(bytes.data());
    return {first, first + bytes.size()};
}

/// Hosts on a cable, each of which loses the same share, and a place for their files.
class Stage {
  public:
    Stage(const ShapeModel& model, const ShapeSettings& settings, int loss, std::size_t receivers)
        : model_(model),
          settings_(settings),
          loss_(loss),
          receivers_(receivers),
          network_(receivers) {
        require(network_.missing().empty(), network_.missing());
        for (std::size_t k = 0; k < receivers; ++k) {
            require(network_.lose(loss, k), "neither nft nor iptables can lose datagrams here");
        }
    }

    std::vector<ShapeRun> our_runs(bool midway);
    std::vector<ShapeRun> rival_runs(const RivalFile& file, bool midway);
    std::vector<RoundsRun> our_rounds(int rounds);

  private:
    [[nodiscard]] fs::path path(std::size_t k, const char* suffix) const {
        return directory_.path() / (std::to_string(k) + suffix);
    }
    [[nodiscard]] Process our_sender(const std::string& rounds) const;
    [[nodiscard]] Process our_receiver(std::size_t k, const Words& more) const;
    [[nodiscard]] json our_report(std::size_t k) const {
        return json::parse(read_file(path(k, ".json")));
    }
    [[nodiscard]] std::vector<ShapePoint> points_of(std::size_t k, bool all) const;
    [[nodiscard]] ShapePoint measured(const fs::path& file, const json& hint) const;
    [[nodiscard]] ShapeRun run_of(const std::string& method, bool midway, int run,
                                  std::size_t receiver) const {
        return {method, model_.name, loss_, receivers_, midway, run, receiver, {}};
    }
    void wait_for_a_moment() {
        std::this_thread::sleep_for(std::chrono::duration<double>(random_.uniform()));
    }

    const ShapeModel& model_;
    const ShapeSettings& settings_;
    int loss_;
    std::size_t receivers_;
    TemporaryDirectory directory_;
    MadeNetwork network_;
    common::Random random_{1};
};

Process Stage::our_sender(const std::string& rounds) const {
    return start_in(
        network_.sender(),
        {ELLICAST_SEND, model_.path.string(), "--to", kGroup, "--interface", "near", "--rate",
         settings_.rate, "--rounds", rounds, "--cache", settings_.cache.string(), "--report",
         (directory_.path() / "sent.json").string(), "--log-level", "warn"});
}

Process Stage::our_receiver(std::size_t k, const Words& more) const {
    fs::remove_all(path(k, ".stages"));
    fs::remove(path(k, ".ply"));
    fs::remove(path(k, ".json"));
    Words words{ELLICAST_RECV,
                "--listen",
                std::string(kGroup) + ":5004",
                "--interface",
                "near",
                "--output",
                path(k, ".ply").string(),
                "--report",
                path(k, ".json").string(),
                "--threads",
                "1"};
    words.insert(words.end(), more.begin(), more.end());
    Process receiver = start_in(network_.receiver(k), words);
    require(receiver->await_err("listening on "), receiver->err());
    return receiver;
}

ShapePoint Stage::measured(const fs::path& file, const json& hint) const {
    const common::TriangleMesh mesh = common::read_model(file);
    const common::MeshTopology topology = common::analyse_topology(mesh);
    require(topology.closed && topology.manifold, file.string() + ": not a closed manifold");
    common::MeshDistanceOptions how;
    how.samples = settings_.samples;
    ShapePoint point;
    point.rms = common::measure_distance(mesh, model_.mesh, how).rms();
    point.right = topology.components == hint["components"].get<std::size_t>() &&
                  topology.euler == hint["euler_all"].get<std::int64_t>();
    return point;
}

/// The meshes that receiver k had, or the first alone. Files tell how long one came after another.
std::vector<ShapePoint> Stage::points_of(std::size_t k, bool all) const {
    const json report = our_report(k);
    std::vector<ShapePoint> points;
    if (report["live"].is_null() || report["live"]["updates"] == 0) return points;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path(k, ".stages"))) {
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    if (fs::exists(path(k, ".ply"))) files.push_back(path(k, ".ply"));
    if (!all) files.resize(1);
    const double first = report["live"]["first_shape_ms"].get<double>() / 1000;
    const auto written = fs::last_write_time(files.front());
    for (const fs::path& file : files) {
        ShapePoint point = measured(file, report["hint"]);
        point.seconds =
            first + std::chrono::duration<double>(fs::last_write_time(file) - written).count();
        points.push_back(point);
    }
    return points;
}

std::vector<ShapeRun> Stage::our_runs(bool midway) {
    std::vector<ShapeRun> runs;
    for (int run = 0; run < settings_.runs; ++run) {
        Process sender;
        if (midway) {
            sender = our_sender("forever");
            // Decomposed before, so it is on air soon.
            std::this_thread::sleep_for(1s);
            wait_for_a_moment();
        }
        std::vector<Process> receivers;
        for (std::size_t k = 0; k < receivers_; ++k) {
            receivers.push_back(our_receiver(
                k, {"--live-stages", path(k, ".stages").string(), "--update-interval",
                    settings_.update_interval, "--until", midway ? "forever" : "end"}));
        }
        if (midway) {
            std::this_thread::sleep_for(kMidwayListening);
            for (const Process& receiver : receivers) receiver->send_signal(SIGTERM);
        } else {
            sender = our_sender("1");
            require(sender->wait(kPatience) == 0, sender->err());
        }
        for (std::size_t k = 0; k < receivers_; ++k) {
            const int code = receivers[k]->wait(kPatience);
            require(code == 0 || code == 3 || code == 4, receivers[k]->err());
        }
        if (midway) sender->send_signal(SIGINT);
        for (std::size_t k = 0; k < receivers_; ++k) {
            runs.push_back(run_of("ellicast", midway, run, k));
            const bool all = k == static_cast<std::size_t>(run) % receivers_;
            runs.back().points = points_of(k, all);
        }
    }
    return runs;
}

std::vector<ShapeRun> Stage::rival_runs(const RivalFile& file, bool midway) {
    std::vector<ShapeRun> runs;
#ifdef ELLICAST_NORM_FILE
    const std::string rate = std::to_string(settings_.bits_per_second);
    for (int run = 0; run < settings_.runs; ++run) {
        Words sending{ELLICAST_NORM_FILE, "send", file.path.string(), "--group", kGroup,
                      "--rate",           rate};
        Process sender;
        if (midway) {
            sending.emplace_back("--repeat");
            sender = start_in(network_.sender(), sending);
            wait_for_a_moment();
        }
        std::vector<Process> receivers;
        for (std::size_t k = 0; k < receivers_; ++k) {
            receivers.push_back(
                start_in(network_.receiver(k), {ELLICAST_NORM_FILE, "receive", file.path.string(),
                                                "--group", kGroup, "--wait", kRivalListening}));
            require(receivers.back()->await_err("listening on "), receivers.back()->err());
        }
        if (!midway) {
            sender = start_in(network_.sender(), sending);
            require(sender->wait(kPatience) == 0, sender->err());
        }
        for (std::size_t k = 0; k < receivers_; ++k) {
            ChildProcess& receiver = *receivers[k];
            const int code = receiver.wait(kPatience);
            require(code == 0 || code == 3, receiver.err());
            runs.push_back(run_of(file.method, midway, run, k));
            if (code != 0) continue;
            const double seconds = json::parse(receiver.out())["seconds"];
            runs.back().points.push_back({seconds, file.rms, true});
        }
    }
#else
    (void)file;
    (void)midway;
#endif
    return runs;
}

std::vector<RoundsRun> Stage::our_rounds(int rounds) {
    std::vector<Process> receivers;
    for (std::size_t k = 0; k < receivers_; ++k) {
        // What is rebuilt does not matter here.
        receivers.push_back(our_receiver(k, {"--grid", "16", "--conceal", "off"}));
    }
    const Process sender = our_sender(std::to_string(rounds));
    require(sender->wait(kPatience) == 0, sender->err());
    const json sent = json::parse(read_file(directory_.path() / "sent.json"));
    std::vector<RoundsRun> runs;
    for (std::size_t k = 0; k < receivers_; ++k) {
        const int code = receivers[k]->wait(kPatience);
        require(code == 0 || code == 4, receivers[k]->err());
        const json vertices = our_report(k)["vertices"];
        RoundsRun run{model_.name, loss_, rounds, 0, 0};
        run.datagrams = sent["models"][0]["datagrams"].get<std::size_t>();
        run.lacking = 1 - vertices["received"].get<double>() / vertices["expected"].get<double>();
        runs.push_back(run);
    }
    return runs;
}

}  // namespace

ShapeModel load_shape_model(const fs::path& path, const fs::path& directory) {
    ShapeModel model;
    model.name = path.stem().string();
    model.path = path;
    model.mesh = common::read_model(path);
    const auto add = [&](const std::string& method, std::span<const char> bytes, double rms) {
        model.rivals.push_back({method, directory / (model.name + "." + method), rms});
        write_bytes(model.rivals.back().path, bytes);
    };
#ifdef ELLICAST_WITH_DRACO
    const std::vector<char> packed = draco_encode(model.mesh);
    add("norm-draco", packed, common::measure_distance(draco_decode(packed), model.mesh).rms());
#endif
    // Without connectivity: what rms one has of these depends on who joins them.
    add("norm-raw", raw_vertices(model.mesh), std::numeric_limits<double>::quiet_NaN());
    return model;
}

std::vector<ShapeRun> run_shapes(const ShapeModel& model, const ShapeSettings& settings, int loss,
                                 std::size_t receivers) {
    Stage stage(model, settings, loss, receivers);
    std::vector<ShapeRun> runs;
    for (const bool midway : {false, true}) {
        const auto take = [&](std::vector<ShapeRun> more) {
            runs.insert(runs.end(), more.begin(), more.end());
        };
        take(stage.our_runs(midway));
        for (const RivalFile& file : model.rivals) take(stage.rival_runs(file, midway));
    }
    return runs;
}

std::vector<RoundsRun> run_rounds(const ShapeModel& model, const ShapeSettings& settings,
                                  int loss) {
    Stage stage(model, settings, loss, kRoundsReceivers);
    std::vector<RoundsRun> runs;
    for (int rounds = 1; rounds <= kMostRounds; ++rounds) {
        const std::vector<RoundsRun> more = stage.our_rounds(rounds);
        runs.insert(runs.end(), more.begin(), more.end());
    }
    return runs;
}

}  // namespace ellicast::tests
