// tests/tools/compare.cpp: ours and its rivals on the same lost datagrams; see scripts/compare.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "tests/tools/compare_modes.hpp"

namespace ellicast::tests {
namespace {

enum class Mode { compare, tables, bursts, blackouts, prefixes, coarse };

struct CommandLine {
    CompareOptions options;
    std::filesystem::path tables_of;
    bool no_anytime = false;
    bool no_intersections = false;
    bool quick = false;
    bool bursts = false;
    bool blackouts = false;
    bool prefixes = false;
    bool coarse = false;

    [[nodiscard]] Mode mode() const {
        if (!tables_of.empty()) return Mode::tables;
        if (bursts) return Mode::bursts;
        if (blackouts) return Mode::blackouts;
        if (prefixes) return Mode::prefixes;
        return coarse ? Mode::coarse : Mode::compare;
    }
};

void add_options(CLI::App& app, CommandLine& line) {
    CompareOptions& o = line.options;
    ComparisonOptions& c = o.comparison;
    app.add_option("MODEL", o.models, "Model files")->check(CLI::ExistingFile);
    app.add_option("--loss", o.losses, "Shares of datagrams lost, with commas between")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    app.add_option("--anytime", o.anytime, "Losses at which errors are taken while data arrives")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    app.add_flag("--no-anytime", line.no_anytime, "Only when everything was sent");
    app.add_option("--seeds", o.seeds, "Loss seeds 1 to K")
        ->check(CLI::Range(1u, 10'000u))
        ->capture_default_str();
    app.add_option("--jobs", o.jobs, "Cells at a time; 0: one per core")
        ->check(CLI::Range(0u, 1024u));
    app.add_option("--methods", c.methods, "With commas between")
        ->delimiter(',')
        ->check(CLI::IsMember(all_methods()))
        ->capture_default_str();
    app.add_option("--burst", c.burst, "Lose in bursts of this mean length")
        ->check(CLI::Range(1.0, 1e6));
    app.add_option("--samples", c.samples, "Of a distance, each way")
        ->check(CLI::Range(std::size_t{100}, std::size_t{100'000'000}))
        ->capture_default_str();
    app.add_flag("--no-intersections", line.no_intersections,
                 "Do not count self-intersecting faces");
    app.add_option("--ellipsoids", c.decomposition.ellipsoids)
        ->check(CLI::Range(std::size_t{1}, std::size_t{protocol::kMaxEllipsoids}))
        ->capture_default_str();
    app.add_option("--candidates", c.decomposition.candidates)
        ->check(CLI::Range(std::size_t{1}, std::size_t{10'000'000}))
        ->capture_default_str();
    app.add_option("--out", o.out, "Directory for tables")->capture_default_str();
    app.add_flag("--quick", line.quick, "One seed, three losses, fewer samples, no anytime curve");
    app.add_flag("--burst-check", line.bursts,
                 "Instead: bursts beside an even loss of as many records");
    app.add_flag("--blackout-check", line.blackouts,
                 "Instead: two seconds of ten lost beside as many datagrams lost anywhere");
    app.add_flag("--prefix-check", line.prefixes,
                 "Instead: the first vertices by importance beside the first of a spread order");
    app.add_flag("--coarse", line.coarse, "Instead: the ellipsoids alone, as volume in common");
    app.add_option("--tables", line.tables_of, "Instead: tables again, of this compare.csv")
        ->check(CLI::ExistingFile);
}

void apply_switches(CommandLine& line) {
    CompareOptions& o = line.options;
    if (line.no_intersections) o.comparison.intersections = false;
    if (line.quick) {
        o.losses = {0, 0.3, 0.7};
        o.seeds = 1;
        o.comparison.samples = 20'000;
    }
    if (line.quick || line.no_anytime) o.anytime.clear();
    if (o.comparison.burst > 0) {  // refuse what cannot be before the work
        for (const double loss : o.losses) bursty_loss(loss, o.comparison.burst);
    }
    if (line.mode() != Mode::tables && o.models.empty()) {
        throw CLI::RequiredError("MODEL");
    }
}

void run(CommandLine& line) {
    apply_switches(line);
    switch (line.mode()) {
        case Mode::tables:
            return write_tables(line.tables_of);
        case Mode::bursts:
            return check_bursts(line.options);
        case Mode::blackouts:
            return check_blackouts(line.options);
        case Mode::prefixes:
            return check_prefixes(line.options);
        case Mode::coarse:
            return check_coarse(line.options);
        case Mode::compare:
            return compare_all(line.options);
    }
}

}  // namespace
}  // namespace ellicast::tests

int main(int argc, char** argv) {
    ellicast::tests::CommandLine line;
    CLI::App app("Runs the pair in one process over loss x seed, beside its rivals.", "compare");
    ellicast::tests::add_options(app, line);
    try {
        app.parse(argc, argv);
        ellicast::tests::run(line);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "compare: %s\n", error.what());
        return 2;
    }
    return 0;
}
