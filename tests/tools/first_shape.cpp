// tests/tools/first_shape.cpp: seconds to the first shape and errors against time, between network
// namespaces whose kernel loses datagrams, beside a file sent by NORM. See scripts/first-shape.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <vector>

#include "common/model_io.hpp"
#include "common/text_values.hpp"
#include "tests/support/child_process.hpp"
#include "tests/tools/first_shape_runs.hpp"
#include "tests/tools/first_shape_tables.hpp"

namespace ellicast::tests {
namespace {

namespace fs = std::filesystem;

struct Options {
    ShapeSettings settings;
    std::vector<int> rounds_losses{30, 50};
    fs::path out = "out/first-shape";
    bool no_rounds = false;
    bool no_shapes = false;
};

std::ofstream opened(const fs::path& path) {
    std::ofstream out(path);
    if (!out) throw common::ModelError("cannot write '" + path.string() + "'");
    return out;
}

void measure_shapes(const Options& options, const std::vector<ShapeModel>& models) {
    std::vector<ShapeRun> runs;
    for (const ShapeModel& model : models) {
        for (const std::size_t receivers : options.settings.receivers) {
            for (const int loss : options.settings.losses) {
                std::fprintf(stderr, "%s, %d %%, %zu receivers\n", model.name.c_str(), loss,
                             receivers);
                const auto more = run_shapes(model, options.settings, loss, receivers);
                runs.insert(runs.end(), more.begin(), more.end());
                // At once, so that one may look while it goes on.
                auto csv = opened(options.out / "first-shape.csv");
                write_shape_csv(csv, runs);
            }
        }
    }
    auto curves = opened(options.out / "curves.csv");
    write_shape_curves(curves, runs);
    auto tables = opened(options.out / "tables.md");
    write_shape_tables(tables, runs);
}

void measure_rounds(const Options& options, const std::vector<ShapeModel>& models) {
    std::vector<RoundsRun> runs;
    for (const ShapeModel& model : models) {
        for (const int loss : options.rounds_losses) {
            std::fprintf(stderr, "%s, %d %%, rounds\n", model.name.c_str(), loss);
            const auto more = run_rounds(model, options.settings, loss);
            runs.insert(runs.end(), more.begin(), more.end());
        }
    }
    auto table = opened(options.out / "rounds.md");
    write_rounds_table(table, runs);
}

void run(Options options) {
    fs::create_directories(options.out);
    const std::uint64_t rate = common::parse_rate(options.settings.rate);
    options.settings.bits_per_second = static_cast<double>(rate);
    const TemporaryDirectory directory;
    options.settings.cache = directory.path() / "cache";
    std::vector<ShapeModel> models;
    for (const fs::path& path : options.settings.models) {
        models.push_back(load_shape_model(path, directory.path()));
    }
    if (!options.no_shapes) measure_shapes(options, models);
    if (!options.no_rounds) measure_rounds(options, models);
}

}  // namespace
}  // namespace ellicast::tests

int main(int argc, char** argv) {
    ellicast::tests::Options options;
    CLI::App app("Seconds to the first shape, and errors against time, beside NORM.");
    ellicast::tests::ShapeSettings& settings = options.settings;
    app.add_option("MODEL", settings.models)->required()->check(CLI::ExistingFile);
    app.add_option("--loss", settings.losses, "percent, several")->capture_default_str();
    app.add_option("--receivers", settings.receivers, "1 to 8, several")
        ->check(CLI::Range(1, 8))
        ->capture_default_str();
    app.add_option("--runs", settings.runs, "of each")->capture_default_str();
    app.add_option("--rate", settings.rate)->capture_default_str();
    app.add_option("--update-interval", settings.update_interval, "of live meshes, seconds")
        ->capture_default_str();
    app.add_option("--samples", settings.samples, "for each distance")->capture_default_str();
    app.add_option("--rounds-loss", options.rounds_losses, "percent, several")
        ->capture_default_str();
    app.add_flag("--no-rounds", options.no_rounds, "do not measure how rounds unite");
    app.add_flag("--no-shapes", options.no_shapes, "only how rounds unite");
    app.add_option("--out", options.out)->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        ellicast::tests::run(std::move(options));
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "first_shape: %s\n", error.what());
        return 2;
    }
}
