// tests/tools/compare_modes.cpp
#include "tests/tools/compare_modes.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "common/mesh_distance.hpp"
#include "common/parallel.hpp"
#include "common/random.hpp"
#include "common/solid_voxels.hpp"

namespace ellicast::tests {
namespace {

// Where nothing is lost, all seeds are one.
void add_cells(double loss, double sent, unsigned seeds, std::vector<Cell>& cells) {
    for (unsigned seed = 1; seed <= (loss > 0 ? seeds : 1); ++seed) {
        cells.push_back({loss, sent, seed});
    }
}

std::vector<Cell> cells_of(const CompareOptions& options) {
    std::vector<Cell> cells;
    for (const double loss : options.losses) add_cells(loss, 1, options.seeds, cells);
    for (const double loss : options.anytime) {
        for (const double share : options.shares) add_cells(loss, share, options.seeds, cells);
        const auto& whole = options.losses;  // the curve's end
        if (std::find(whole.begin(), whole.end(), loss) == whole.end()) {
            add_cells(loss, 1, options.seeds, cells);
        }
    }
    return cells;
}

// Takes cells in as they end, and writes them in order.
class OrderedRows {
  public:
    OrderedRows(std::ofstream& csv, std::size_t cells) : csv_(csv), rows_(cells) {}

    void take(std::size_t cell, std::vector<ComparisonRow> rows) {
        const std::lock_guard lock(mutex_);
        for (const ComparisonRow& row : rows) {
            std::fprintf(stderr,
                         "%s, loss %g, sent %g, seed %u, %s: rms %.2e, topology %s, %.1f s\n",
                         row.model.c_str(), row.loss, row.sent, row.seed, row.method.c_str(),
                         row.rms, row.topology_right ? "right" : "wrong", row.cpu_seconds);
        }
        rows_[cell] = std::move(rows);
        for (; next_ < rows_.size() && rows_[next_]; ++next_) {
            for (const ComparisonRow& row : *rows_[next_]) write_csv(csv_, row);
        }
        csv_.flush();
    }

  private:
    std::mutex mutex_;
    std::ofstream& csv_;
    std::vector<std::optional<std::vector<ComparisonRow>>> rows_;
    std::size_t next_ = 0;
};

// `count` of the indices below `all`, ascending.
std::vector<std::uint32_t> some_of(std::size_t all, std::size_t count, common::Random& random) {
    std::vector<std::uint32_t> indices(all);
    for (std::size_t k = 0; k < all; ++k) indices[k] = static_cast<std::uint32_t>(k);
    common::shuffle(indices, random);
    indices.resize(count);
    std::sort(indices.begin(), indices.end());
    return indices;
}

// As many records of either kind as `like` has, from anywhere.
receiver::ReceivedObject thinned(const sender::BroadcastObject& object,
                                 const receiver::ReceivedObject& like, std::uint64_t seed) {
    common::Random random(seed);
    receiver::ReceivedObject thin;
    thin.id = object.id;
    thin.hint = object.hint;
    thin.description = object.description;
    thin.ellipsoid_index = some_of(object.ellipsoids.size(), like.ellipsoids.size(), random);
    for (const std::uint32_t k : thin.ellipsoid_index)
        thin.ellipsoids.push_back(object.ellipsoids[k]);
    thin.vertex_index = some_of(object.vertices.size(), like.vertices.size(), random);
    for (const std::uint32_t k : thin.vertex_index) thin.vertices.push_back(object.vertices[k]);
    return thin;
}

struct BurstPair {
    std::size_t ellipsoids = 0;
    std::size_t vertices = 0;
    std::vector<double> in_bursts;  // rms by variant
    std::vector<double> anywhere;
};

constexpr double kBurstLoss = 0.2;
constexpr double kBurstLength = 20;
constexpr std::size_t kLeastDatagrams = 400;

BurstPair run_burst_pair(const ComparedModel& model, unsigned seed,
                         const ComparisonOptions& options) {
    const CellReception burst = receive_cell(model, {kBurstLoss, 1, seed}, kBurstLength);
    BurstPair pair;
    pair.ellipsoids = burst.object.ellipsoids.size();
    pair.vertices = burst.object.vertices.size();
    CellReception thin;
    thin.object = thinned(model.plain.loaded.object, burst.object, seed);
    for (const VariantObject& variant : model.variants) {
        for (const auto& [reception, errors] :
             {std::pair{&burst, &pair.in_bursts}, {&thin, &pair.anywhere}}) {
            errors->push_back(run_variant(model, variant, *reception, options).rms);
        }
    }
    return pair;
}

}  // namespace

std::ofstream create(const std::filesystem::path& path) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream file(path);
    if (!file) throw std::runtime_error("cannot write " + path.string());
    return file;
}

void finish(std::ofstream& file, const std::filesystem::path& path) {
    file.flush();
    if (!file) throw std::runtime_error("cannot write " + path.string());
}

void run_jobs(std::size_t count, unsigned jobs, const std::function<void(std::size_t)>& body) {
    if (jobs == 0) jobs = std::max(1u, std::thread::hardware_concurrency());
    std::atomic<std::size_t> next{0};
    common::parallel_for(jobs, jobs, [&](std::size_t, std::size_t) {
        for (std::size_t k = next++; k < count; k = next++) body(k);
    });
}

double median(std::vector<double> values) {
    if (values.empty()) return ComparisonRow::kNone;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

void compare_all(const CompareOptions& options) {
    const std::filesystem::path path = options.out / "compare.csv";
    std::ofstream csv = create(path);
    write_csv_header(csv);
    for (const std::filesystem::path& file : options.models) {
        const ComparedModel model = load_compared(file, options.comparison);
        for (const std::string& warning : model.plain.loaded.warnings) {
            std::fprintf(stderr, "%s: %s\n", model.name.c_str(), warning.c_str());
        }
        const std::vector<Cell> cells = cells_of(options);
        OrderedRows rows(csv, cells.size());
        run_jobs(cells.size(), options.jobs, [&](std::size_t k) {
            rows.take(k, run_cell(model, cells[k], options.comparison));
        });
    }
    finish(csv, path);
    csv.close();
    write_tables(path);
}

void write_tables(const std::filesystem::path& path) {
    std::ifstream csv(path);
    if (!csv) throw std::runtime_error("cannot read " + path.string());
    const std::vector<ComparisonMedian> medians = medians_of(read_csv(csv));
    std::ofstream numbers = create(path.parent_path() / "medians.csv");
    write_medians(numbers, medians);
    finish(numbers, path.parent_path() / "medians.csv");
    std::ofstream tables = create(path.parent_path() / "tables.md");
    write_markdown(tables, medians);
    finish(tables, path.parent_path() / "tables.md");
}

void check_bursts(const CompareOptions& options) {
    const std::filesystem::path path = options.out / "burst-check.csv";
    std::ofstream csv = create(path);
    csv << "model,method,seed,ellipsoids,vertices,rms_in_bursts,rms_anywhere\n";
    std::printf(
        "| model | method | bursts | anywhere | ratio |\n| --- | --- | --- | --- | --- |\n");
    for (const std::filesystem::path& file : options.models) {
        const ComparedModel model = load_compared(file, options.comparison);
        if (model.stream.size() < kLeastDatagrams) {
            std::fprintf(stderr, "%s: only %zu datagrams, left out\n", model.name.c_str(),
                         model.stream.size());
            continue;
        }
        std::vector<BurstPair> pairs(options.seeds);
        run_jobs(pairs.size(), options.jobs, [&](std::size_t k) {
            pairs[k] = run_burst_pair(model, static_cast<unsigned>(k + 1), options.comparison);
        });
        for (std::size_t v = 0; v < model.variants.size(); ++v) {
            const std::string name(model.variants[v].variant.name);
            std::vector<double> in_bursts;
            std::vector<double> anywhere;
            for (std::size_t k = 0; k < pairs.size(); ++k) {
                in_bursts.push_back(pairs[k].in_bursts[v]);
                anywhere.push_back(pairs[k].anywhere[v]);
                csv << model.name << ',' << name << ',' << k + 1 << ',' << pairs[k].ellipsoids
                    << ',' << pairs[k].vertices << ',' << in_bursts.back() << ',' << anywhere.back()
                    << '\n';
            }
            const double a = median(in_bursts);
            const double b = median(anywhere);
            std::printf("| %s | %s | %.2f | %.2f | %.2f |\n", model.name.c_str(), name.c_str(),
                        1e4 * a, 1e4 * b, a / b);
            std::fflush(stdout);
        }
    }
    finish(csv, path);
}

void check_coarse(const CompareOptions& options) {
    const std::filesystem::path path = options.out / "coarse.csv";
    std::ofstream csv = create(path);
    csv << "model,ellipsoids,overlap,rms,topology_right\n";
    std::printf("| model | IoU at 100 / 200 / 400 ellipsoids | rms, 1e-4 |\n| --- | --- | --- |\n");
    for (const std::filesystem::path& file : options.models) {
        std::string overlaps;
        std::string errors;
        const std::string name = file.stem().string();
        for (const std::size_t count : {100u, 200u, 400u}) {
            ComparisonOptions how = options.comparison;
            how.decomposition.ellipsoids = count;
            const SimulatedModel model =
                load_simulated(file, how.decomposition, {.normal_bits = 0, .colour = false});
            receiver::ReceivedObject object;
            object.hint = model.loaded.object.hint;
            object.description = model.loaded.object.description;
            object.ellipsoids = model.loaded.object.ellipsoids;
            for (std::uint32_t k = 0; k < object.ellipsoids.size(); ++k) {
                object.ellipsoid_index.push_back(k);
            }
            const auto coarse = receiver::reconstruct(object);
            if (!coarse) throw std::runtime_error(name + ": no coarse surface");
            ComparisonRow row;
            how.intersections = false;
            judge(coarse->mesh, model, how, row);
            const double overlap =
                common::volume_overlap(coarse->mesh, sender::prepare_model(model.original).solid);
            csv << name << ',' << count << ',' << overlap << ',' << row.rms << ','
                << row.topology_right << '\n';
            char text[32];
            std::snprintf(text, sizeof text, "%s%.3f", overlaps.empty() ? "" : " / ", overlap);
            overlaps += text;
            std::snprintf(text, sizeof text, "%s%.0f%s", errors.empty() ? "" : " / ", 1e4 * row.rms,
                          row.topology_right ? "" : "*");
            errors += text;
        }
        std::printf("| %s | %s | %s |\n", name.c_str(), overlaps.c_str(), errors.c_str());
        std::fflush(stdout);
    }
    finish(csv, path);
}

}  // namespace ellicast::tests
