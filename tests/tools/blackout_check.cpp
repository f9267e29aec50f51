// tests/tools/blackout_check.cpp: a fifth of the stream lost at once, and anywhere.
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/sampling_gaps.hpp"
#include "tests/tools/compare_modes.hpp"

namespace ellicast::tests {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kStream = 10s - 1ms;  // the last datagram leaves before its end
constexpr std::chrono::nanoseconds kBlackout = 2s;
constexpr const char* kMethod = "ellicast-tags";

struct Position {
    const char* name;
    std::chrono::nanoseconds begin;
};
constexpr std::array<Position, 3> kPositions{{{"start", 0s}, {"middle", 4s}, {"end", 8s}}};

// What a loss leaves. Lengths as shares of the model's diagonal.
struct Outcome {
    SamplingGaps gaps;
    double rms = 0;
    double max = 0;
    bool right = false;
};

double diagonal_of(const common::TriangleMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : mesh.positions) box.extend(p);
    return box.diagonal().norm();
}

Outcome outcome_of(const ComparedModel& model, const std::vector<TimedDatagram>& heard,
                   const ComparisonOptions& options) {
    CellReception reception;
    receiver::SessionOptions listening;
    listening.wait = kStream;  // before the first datagram; then the program's silence
    auto object = receive(heard, listening).object;
    if (!object) throw std::runtime_error(model.name + ": nothing received");
    reception.object = *std::move(object);
    Outcome outcome;
    const double diagonal = diagonal_of(model.plain.original);
    outcome.gaps =
        sampling_gaps(model.plain.original.positions, received_positions(reception.object));
    outcome.gaps.percentile_99 /= diagonal;
    outcome.gaps.largest /= diagonal;
    for (const VariantObject& variant : model.variants) {
        if (variant.variant.name != kMethod) continue;
        const ComparisonRow row = run_variant(model, variant, reception, options);
        outcome.rms = row.rms;
        outcome.max = row.max;
        outcome.right = row.topology_right;
    }
    return outcome;
}

// The blackouts by position, and after them the losses anywhere by seed.
std::vector<Outcome> outcomes_of(const ComparedModel& model, const CompareOptions& options) {
    const std::vector<TimedDatagram> stream = stretched(model.stream, kStream);
    std::vector<std::vector<TimedDatagram>> heard;
    heard.reserve(std::size(kPositions) + options.seeds);
    for (const Position& position : kPositions) {
        heard.push_back(without_blackout(stream, position.begin, position.begin + kBlackout));
    }
    const std::size_t as_many = heard[1].size();
    for (unsigned seed = 1; seed <= options.seeds; ++seed) {
        heard.push_back(some_of(stream, as_many, seed));
    }
    std::vector<Outcome> outcomes(heard.size());
    run_jobs(heard.size(), options.jobs,
             [&](std::size_t k) { outcomes[k] = outcome_of(model, heard[k], options.comparison); });
    return outcomes;
}

Outcome median_of(const std::vector<Outcome>& outcomes) {
    std::vector<double> percentiles;
    std::vector<double> largest;
    std::vector<double> rms;
    std::vector<double> max;
    Outcome middle;
    middle.right = true;
    for (const Outcome& outcome : outcomes) {
        percentiles.push_back(outcome.gaps.percentile_99);
        largest.push_back(outcome.gaps.largest);
        rms.push_back(outcome.rms);
        max.push_back(outcome.max);
        middle.right = middle.right && outcome.right;
    }
    middle.gaps = {median(percentiles), median(largest)};
    middle.rms = median(rms);
    middle.max = median(max);
    return middle;
}

void print_row(const std::string& model, const char* where, const Outcome& outcome) {
    std::printf("| %s | %s | %.1f | %.1f | %.2f | %.0f | %s |\n", model.c_str(), where,
                1e4 * outcome.gaps.percentile_99, 1e4 * outcome.gaps.largest, 1e4 * outcome.rms,
                1e4 * outcome.max, outcome.right ? "right" : "wrong");
    std::fflush(stdout);
}

}  // namespace

void check_blackouts(const CompareOptions& options) {
    const std::filesystem::path path = options.out / "blackout-check.csv";
    std::ofstream csv = create(path);
    csv << "model,lost,gap_99_percent,largest_gap,rms,max,topology_right\n";
    std::printf(
        "| model | lost | gaps, 99 %% below | largest gap | rms | max | topology |\n"
        "| --- | --- | --- | --- | --- | --- | --- |\n");
    for (const std::filesystem::path& file : options.models) {
        const ComparedModel model = load_compared(file, options.comparison);
        const std::vector<Outcome> outcomes = outcomes_of(model, options);
        for (std::size_t k = 0; k < outcomes.size(); ++k) {
            const Outcome& o = outcomes[k];
            csv << model.name << ','
                << (k < kPositions.size() ? kPositions[k].name
                                          : std::to_string(k + 1 - kPositions.size()))
                << ',' << o.gaps.percentile_99 << ',' << o.gaps.largest << ',' << o.rms << ','
                << o.max << ',' << o.right << '\n';
            if (k < kPositions.size()) print_row(model.name, kPositions[k].name, o);
        }
        print_row(model.name, "anywhere",
                  median_of({outcomes.begin() + kPositions.size(), outcomes.end()}));
    }
    finish(csv, path);
}

}  // namespace ellicast::tests
