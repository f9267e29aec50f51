// tests/support/comparison_table.hpp: what comparisons write down, and tables made of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <limits>
#include <string>
#include <vector>

namespace ellicast::tests {

/// One method on what one seeded loss left of one model's stream. Lengths are shares of the
/// original's diagonal; NaN where there is no surface.
struct ComparisonRow {
    static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

    std::string model;
    std::string method;
    double loss = 0;
    double sent = 1;  // share of the stream's datagrams that had been sent: the anytime axis
    unsigned seed = 1;
    std::uint64_t vertices = 0;  // that the method had
    std::uint64_t ellipsoids = 0;
    std::uint64_t bytes = 0;         // that arrived of the method's own stream
    std::uint64_t stream_bytes = 0;  // of that stream in all
    double rms = kNone;              // the larger of the two directions
    double rms_to = kNone;           // of the surface to the original
    double rms_from = kNone;
    double mean = kNone;
    double max = kNone;
    double normal_deg = kNone;
    std::size_t components = 0;
    std::int64_t genus = 0;
    bool closed = false;
    bool manifold = false;
    bool topology_right = false;
    std::uint64_t left_over = 0;             // received vertices not used, or lost ones not removed
    double self_intersecting_faces = kNone;  // a count; NaN: not counted
    double cpu_seconds = 0;

    [[nodiscard]] bool has_surface() const { return rms == rms; }
};

/// CSV: a line of column names, then a line a row; no quoting, so names must be without commas.
void write_csv_header(std::ostream& out);
void write_csv(std::ostream& out, const ComparisonRow& row);
/// Throws std::runtime_error that names the line for what write_csv did not write.
std::vector<ComparisonRow> read_csv(std::istream& in);

/// Rows of one model, method, loss and share sent: medians over the seeds. No surface counts as an
/// infinite error, so that half the runs without one make NaN; least and largest are over the
/// others. There is no ratio to a floor that is exact.
struct ComparisonMedian {
    std::string model;
    std::string method;
    double loss = 0;
    double sent = 1;
    std::size_t runs = 0;
    std::size_t surfaces = 0;
    std::size_t right = 0;
    double rms = ComparisonRow::kNone;
    double rms_least = ComparisonRow::kNone;
    double rms_largest = ComparisonRow::kNone;
    double max = ComparisonRow::kNone;
    double vertices = 0;
    double bytes = 0;
    double stream_bytes = 0;
    double self_intersecting_faces = ComparisonRow::kNone;
    double cpu_seconds = 0;
    double to_floor = ComparisonRow::kNone;      // rms over that of the method "floor"
    double max_to_floor = ComparisonRow::kNone;  // the same of max
};

/// In order of first appearance.
std::vector<ComparisonMedian> medians_of(const std::vector<ComparisonRow>& rows);
void write_medians(std::ostream& out, const std::vector<ComparisonMedian>& medians);

/// Markdown for the README. Of rows with everything sent: for every model, rms in 1e-4 by method
/// and loss (`*` where a run's topology is wrong, with a count), then the geometric mean over the
/// models of rms over the floor's, topology, max error and self-intersections by method. Of rows
/// with less sent: rms by share.
void write_markdown(std::ostream& out, const std::vector<ComparisonMedian>& medians);

}  // namespace ellicast::tests
