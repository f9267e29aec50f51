// tests/tools/first_shape_tables.cpp
#include "tests/tools/first_shape_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

namespace ellicast::tests {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::array kTableMoments{0.03, 0.1, 0.3, 1.0, kNever};  // seconds
constexpr double kFirstMoment = 0.002;
constexpr double kLastMoment = 5.0;
constexpr int kMomentsADecade = 40;

/// What runs have in common that stand for one number.
struct Case {
    std::string model;
    std::string method;
    bool midway = false;
    std::size_t receivers = 1;
    int loss = 0;
    auto operator<=>(const Case&) const = default;
};
using Cases = std::map<Case, std::vector<const ShapeRun*>>;

Cases cases_of(std::span<const ShapeRun> runs) {
    Cases cases;
    for (const ShapeRun& run : runs) {
        cases[{run.model, run.method, run.midway, run.receivers, run.loss}].push_back(&run);
    }
    return cases;
}

double median(std::vector<double> values) {
    if (values.empty()) return kNever;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double first_of(const ShapeRun& run) {
    if (run.points.empty()) return kNever;
    return run.points.front().seconds;
}

double first_right_of(const ShapeRun& run) {
    const auto right = std::find_if(run.points.begin(), run.points.end(),
                                    [](const ShapePoint& point) { return point.right; });
    if (right == run.points.end()) return kNever;
    return right->seconds;
}

/// rms of the mesh at hand at that moment.
double rms_at(const ShapeRun& run, double seconds) {
    double rms = kNever;
    for (const ShapePoint& point : run.points) {
        if (point.seconds <= seconds) rms = point.rms;
    }
    return rms;
}

/// Of several receivers of one transmission only one has all its meshes measured.
bool is_measured(const ShapeRun& run) {
    if (run.method != "ellicast" || run.points.empty() || run.receivers == 1) return true;
    return static_cast<std::size_t>(run.run) % run.receivers == run.receiver;
}

double median_rms_at(const std::vector<const ShapeRun*>& runs, double seconds) {
    std::vector<double> values;
    for (const ShapeRun* run : runs) {
        if (is_measured(*run)) values.push_back(rms_at(*run, seconds));
    }
    return median(std::move(values));
}

std::string start_of(const Case& c) {
    return c.midway ? "midway" : "start";
}

std::vector<int> losses_of(const Cases& cases) {
    std::vector<int> losses;
    for (const auto& [c, runs] : cases) losses.push_back(c.loss);
    std::sort(losses.begin(), losses.end());
    losses.erase(std::unique(losses.begin(), losses.end()), losses.end());
    return losses;
}

/// "0.021 (0.034)", the median and the most; how many had anything where not all did.
std::string seconds_text(const std::vector<double>& seconds) {
    std::vector<double> had;
    for (const double s : seconds) {
        if (std::isfinite(s)) had.push_back(s);
    }
    if (had.empty()) return "never";
    std::string text =
        fmt::format("{:.3f} ({:.3f})", median(had), *std::max_element(had.begin(), had.end()));
    if (had.size() < seconds.size()) {
        text += fmt::format(", {} of {}", had.size(), seconds.size());
    }
    return text;
}

std::string rms_text(double rms) {
    return std::isfinite(rms) ? fmt::format("{:.2g}", 1e4 * rms) : "-";
}

std::string label_of(const Case& c) {
    return fmt::format("{} | {} | {} | {} |", c.model, c.method, c.midway ? "midway" : "the start",
                       c.receivers);
}

/// A row for each case but its loss; cells by loss.
template <class Cell>
void write_table(std::ostream& out, const Cases& cases, const std::string& title,
                 const Cell& cell) {
    const std::vector<int> losses = losses_of(cases);
    out << title << ":\n\n| model | method | listening from | receivers |";
    for (const int loss : losses) out << ' ' << loss << " % |";
    out << "\n| --- | --- | --- | --- |";
    for (std::size_t k = 0; k < losses.size(); ++k) out << " --- |";
    Case row;
    for (const auto& [c, runs] : cases) {
        Case same = c;
        same.loss = row.loss;
        if (same != row || &c == &cases.begin()->first) out << "\n| " << label_of(c);
        row = c;
        out << ' ' << cell(runs) << " |";
    }
    out << "\n\n";
}

}  // namespace

void write_shape_csv(std::ostream& out, std::span<const ShapeRun> runs) {
    out << "method,model,loss,receivers,start,run,receiver,mesh,seconds,rms,right\n";
    for (const ShapeRun& run : runs) {
        const std::string head =
            fmt::format("{},{},{},{},{},{},{}", run.method, run.model, run.loss, run.receivers,
                        run.midway ? "midway" : "start", run.run, run.receiver);
        if (run.points.empty()) out << head << ",0,nan,nan,0\n";
        for (std::size_t k = 0; k < run.points.size(); ++k) {
            const ShapePoint& point = run.points[k];
            out << head
                << fmt::format(",{},{:.4f},{:.3e},{}\n", k + 1, point.seconds, point.rms,
                               point.right ? 1 : 0);
        }
    }
}

void write_shape_curves(std::ostream& out, std::span<const ShapeRun> runs) {
    out << "method,model,loss,receivers,start,seconds,rms\n";
    for (const auto& [c, same] : cases_of(runs)) {
        for (int k = 0;; ++k) {
            const double seconds = kFirstMoment * std::pow(10.0, k / double{kMomentsADecade});
            if (seconds > kLastMoment) break;
            const double rms = median_rms_at(same, seconds);
            out << fmt::format("{},{},{},{},{},{:.4f},", c.method, c.model, c.loss, c.receivers,
                               start_of(c), seconds)
                << (std::isfinite(rms) ? fmt::format("{:.3e}", rms) : "nan") << '\n';
        }
    }
}

void write_shape_tables(std::ostream& out, std::span<const ShapeRun> runs) {
    const Cases cases = cases_of(runs);
    write_table(out, cases,
                "Seconds from the first datagram to the first closed shape, or to the whole file "
                "of a rival: median (most)",
                [](const auto& same) {
                    std::vector<double> seconds;
                    seconds.reserve(same.size());
                    for (const ShapeRun* run : same) seconds.push_back(first_of(*run));
                    return seconds_text(seconds);
                });
    Cases ours;
    for (const auto& [c, same] : cases) {
        if (c.method == "ellicast") ours[c] = same;
    }
    write_table(out, ours, "Seconds to the first mesh of the promised topology: median (most)",
                [](const auto& same) {
                    std::vector<double> seconds;
                    for (const ShapeRun* run : same) {
                        if (is_measured(*run)) seconds.push_back(first_right_of(*run));
                    }
                    return seconds_text(seconds);
                });
    for (const double seconds : kTableMoments) {
        const std::string when =
            std::isfinite(seconds) ? fmt::format("after {} s", seconds) : "of the last mesh";
        write_table(out, ours, fmt::format("rms in 1e-4 {}, median", when),
                    [&](const auto& same) { return rms_text(median_rms_at(same, seconds)); });
    }
    const auto right = [](const auto& same) {
        std::size_t good = 0;
        std::size_t all = 0;
        for (const ShapeRun* run : same) {
            if (!is_measured(*run) || run->points.empty()) continue;
            ++all;
            good += run->points.back().right ? 1 : 0;
        }
        return fmt::format("{} of {}", good, all);
    };
    write_table(out, ours, "Last meshes of the promised topology", right);
}

void write_rounds_table(std::ostream& out, std::span<const RoundsRun> runs) {
    std::map<std::tuple<std::string, int, int>, std::vector<const RoundsRun*>> cases;
    for (const RoundsRun& run : runs) cases[{run.model, run.loss, run.rounds}].push_back(&run);
    out << "| model | loss | rounds | vertices lacking, mean (least to most) | expected | standard "
           "deviation of one receiver |\n| --- | --- | --- | --- | --- | --- |\n";
    for (const auto& [key, same] : cases) {
        const auto& [model, loss, rounds] = key;
        double sum = 0;
        double least = 1;
        double most = 0;
        for (const RoundsRun* run : same) {
            sum += run->lacking;
            least = std::min(least, run->lacking);
            most = std::max(most, run->lacking);
        }
        const double expected = std::pow(loss / 100.0, rounds);
        // Vertices of a datagram are lost together.
        const double deviation =
            std::sqrt(expected * (1 - expected) / static_cast<double>(same.front()->datagrams));
        out << fmt::format(
            "| {} | {} % | {} | {:.2f} % ({:.2f} to {:.2f}) | {:.2f} % | {:.2f} % |\n", model, loss,
            rounds, 100 * sum / static_cast<double>(same.size()), 100 * least, 100 * most,
            100 * expected, 100 * deviation);
    }
}

}  // namespace ellicast::tests
