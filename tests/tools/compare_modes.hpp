// tests/tools/compare_modes.hpp: what the compare tool can do.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "tests/support/comparison.hpp"

namespace ellicast::tests {

struct CompareOptions {
    std::vector<std::filesystem::path> models;
    std::vector<double> losses{0, 0.1, 0.3, 0.5, 0.7, 0.9};
    std::vector<double> anytime{0, 0.3};  // losses at which the shares sent are gone through
    std::vector<double> shares{0.02, 0.05, 0.1, 0.25, 0.5, 0.75};
    unsigned seeds = 5;
    unsigned jobs = 0;  // cells at a time; 0: one per core
    std::filesystem::path out = "out/compare";
    ComparisonOptions comparison;
};

/// Opens a file for writing, and its directory; throws std::runtime_error.
std::ofstream create(const std::filesystem::path& path);

/// Throws std::runtime_error where not all could be written.
void finish(std::ofstream& file, const std::filesystem::path& path);

/// body(k) for k in [0, count), up to `jobs` at a time, in no order. The first exception is
/// rethrown when all have ended.
void run_jobs(std::size_t count, unsigned jobs, const std::function<void(std::size_t)>& body);

/// Of an even number of values the mean of the middle two; kNone of none.
double median(std::vector<double> values);

/// The whole comparison: compare.csv, row by row as cells end, in order; then the tables.
void compare_all(const CompareOptions& options);

/// medians.csv and tables.md in the same directory, from compare.csv.
void write_tables(const std::filesystem::path& csv);

/// Bursts of mean 20 datagrams at 20 % loss beside as many ellipsoids and vertices taken from
/// anywhere: burst-check.csv, and a Markdown table of the medians of their rms on standard output.
void check_bursts(const CompareOptions& options);

/// Every round as a stream of ten seconds, with a blackout of two at its start, in the middle and
/// at its end, beside as many datagrams lost anywhere: distances from the original's vertices to
/// the nearest received one, and errors with 8-bit normals. blackout-check.csv, and a Markdown
/// table on standard output; what is anywhere is the median of the seeds.
void check_blackouts(const CompareOptions& options);

/// All ellipsoids and the first 10, 25 and 50 % of the vertices, by importance and spread, with and
/// without tags and concealment, and the floors of the same vertices: prefix-check.csv, and a
/// Markdown table on standard output, with geometric means over the models at its end.
void check_prefixes(const CompareOptions& options);

/// The coarse stage alone, nothing lost, at 100, 200 and 400 ellipsoids: share of the joint volume
/// that it has in common with the solid, and rms. coarse.csv, and Markdown on standard output.
void check_coarse(const CompareOptions& options);

}  // namespace ellicast::tests
