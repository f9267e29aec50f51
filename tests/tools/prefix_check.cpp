// tests/tools/prefix_check.cpp: the beginning of an order by importance beside a spread one.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/floor.hpp"
#include "tests/tools/compare_modes.hpp"

namespace ellicast::tests {
namespace {

constexpr std::array kShares{0.1, 0.25, 0.5};
constexpr std::array kOrders{sender::SendingOrder::importance, sender::SendingOrder::spread};

struct Way {
    const char* name;
    int normal_bits;
    bool conceal;
};
constexpr std::array<Way, 4> kWays{{{"no tags", 0, true},
                                    {"no tags, unconcealed", 0, false},
                                    {"8-bit normals", 8, true},
                                    {"8-bit normals, unconcealed", 8, false}}};

// rms of one way at one share, by order.
struct PrefixErrors {
    std::array<double, kOrders.size()> ours{};
    std::array<double, kOrders.size()> floor{};
};
using ModelErrors = std::array<std::array<PrefixErrors, kWays.size()>, kShares.size()>;

// All ellipsoids, the first `share` of the vertices, and the edges told by then.
receiver::ReceivedObject prefix_of(const sender::BroadcastObject& object, double share) {
    receiver::ReceivedObject prefix;
    prefix.id = object.id;
    prefix.hint = object.hint;
    prefix.description = object.description;
    prefix.ellipsoids = object.ellipsoids;
    for (std::uint32_t k = 0; k < object.ellipsoids.size(); ++k) {
        prefix.ellipsoid_index.push_back(k);
    }
    const auto count = static_cast<std::uint32_t>(
        std::llround(share * static_cast<double>(object.vertices.size())));
    for (std::uint32_t k = 0; k < count; ++k) {
        prefix.vertex_index.push_back(k);
        prefix.vertices.push_back(object.vertices[k]);
    }
    // Two copies of the edges are spread over a round, the first one by half of it.
    const auto told = static_cast<std::ptrdiff_t>(std::min(1.0, 2 * share) *
                                                  static_cast<double>(object.edges.size()));
    prefix.edges.assign(object.edges.begin(), object.edges.begin() + told);
    std::sort(prefix.edges.begin(), prefix.edges.end());
    return prefix;
}

double rms_of(const common::TriangleMesh& mesh, const SimulatedModel& model,
              const ComparisonOptions& options) {
    ComparisonRow row;
    judge(mesh, model, options, row);
    return row.rms;
}

double rms_of_floor(const ComparedModel& model, double share, const ComparisonOptions& options) {
    const receiver::ReceivedObject prefix = prefix_of(model.plain.loaded.object, share);
    return rms_of(collapse_onto(model.plain.original, kept_vertices(model, prefix)), model.plain,
                  options);
}

double rms_of_pair(const SimulatedModel& model, double share, bool conceal,
                   const ComparisonOptions& options) {
    receiver::ReconstructionOptions how;
    how.threads = 1;
    how.conceal = conceal;
    const auto result = receiver::reconstruct(prefix_of(model.loaded.object, share), how);
    if (!result) throw std::runtime_error(model.loaded.object.description.name + ": no surface");
    return rms_of(result->mesh, model, options);
}

ModelErrors errors_of(const std::filesystem::path& file, const CompareOptions& options) {
    ComparisonOptions how = options.comparison;
    how.intersections = false;
    const common::TriangleMesh original = common::read_model(file);
    const TemporaryDirectory cache;  // one decomposition for all of them
    std::array<std::array<ComparedModel, kWays.size()>, kOrders.size()> models;
    for (std::size_t o = 0; o < kOrders.size(); ++o) {
        for (std::size_t w = 0; w < kWays.size(); ++w) {
            const sender::TagOptions tags{
                .normal_bits = kWays[w].normal_bits, .ring = false, .colour = false};
            ComparedModel& model = models[o][w];
            model.plain = {original, sender::load_model(file, how.decomposition, cache.path(), tags,
                                                        kOrders[o])};
            model.record_of = records_of_original(model.plain);
        }
    }
    ModelErrors errors;
    constexpr std::size_t kMethods = kWays.size() + 1;  // the last one is the floor
    run_jobs(kShares.size() * kOrders.size() * kMethods, options.jobs, [&](std::size_t job) {
        const std::size_t o = job % kOrders.size();
        const std::size_t w = job / kOrders.size() % kMethods;
        const std::size_t s = job / kOrders.size() / kMethods;
        if (w < kWays.size()) {
            errors[s][w].ours[o] =
                rms_of_pair(models[o][w].plain, kShares[s], kWays[w].conceal, how);
            return;
        }
        const double floor = rms_of_floor(models[o][0], kShares[s], how);
        for (PrefixErrors& e : errors[s]) e.floor[o] = floor;
    });
    return errors;
}

double ratio(const std::array<double, kOrders.size()>& errors) {
    return errors[0] / errors[1];
}

// Geometric means over the models of what the check is about.
class Means {
  public:
    void add(const PrefixErrors& e) {
        ours_ += std::log(ratio(e.ours));
        floor_ += std::log(ratio(e.floor));
        over_floor_ += std::log(e.ours[0] / e.floor[0]);
        ++count_;
    }
    void print(double share, const char* way) const {
        const auto mean = [this](double sum) { return std::exp(sum / count_); };
        std::printf("| all | %g %% | %s | | | %.2f | | | %.2f | %.2f |\n", 100 * share, way,
                    mean(ours_), mean(floor_), mean(over_floor_));
    }

  private:
    double ours_ = 0;
    double floor_ = 0;
    double over_floor_ = 0;
    double count_ = 0;
};

void print(const std::string& model, double share, const char* way, const PrefixErrors& e) {
    std::printf("| %s | %g %% | %s | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n",
                model.c_str(), 100 * share, way, 1e4 * e.ours[0], 1e4 * e.ours[1], ratio(e.ours),
                1e4 * e.floor[0], 1e4 * e.floor[1], ratio(e.floor), e.ours[0] / e.floor[0]);
}

}  // namespace

void check_prefixes(const CompareOptions& options) {
    const std::filesystem::path path = options.out / "prefix-check.csv";
    std::ofstream csv = create(path);
    csv << "model,share,method,rms_importance,rms_spread,floor_importance,floor_spread\n";
    std::printf(
        "| model | first | method | importance | spread | ratio | floor: importance | spread | "
        "ratio | ours / floor |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
    std::array<std::array<Means, kWays.size()>, kShares.size()> means;
    for (const std::filesystem::path& file : options.models) {
        const std::string name = file.stem().string();
        const ModelErrors errors = errors_of(file, options);
        for (std::size_t s = 0; s < kShares.size(); ++s) {
            for (std::size_t w = 0; w < kWays.size(); ++w) {
                const PrefixErrors& e = errors[s][w];
                csv << name << ',' << kShares[s] << ",\"" << kWays[w].name << "\"," << e.ours[0]
                    << ',' << e.ours[1] << ',' << e.floor[0] << ',' << e.floor[1] << '\n';
                print(name, kShares[s], kWays[w].name, e);
                means[s][w].add(e);
            }
        }
        std::fflush(stdout);
    }
    for (std::size_t s = 0; s < kShares.size(); ++s) {
        for (std::size_t w = 0; w < kWays.size(); ++w) means[s][w].print(kShares[s], kWays[w].name);
    }
    finish(csv, path);
}

}  // namespace ellicast::tests
