// tests/support/comparison_markdown.cpp: the tables of comparison_table.hpp as Markdown.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/comparison_table.hpp"

namespace ellicast::tests {
namespace {

using Medians = std::vector<ComparisonMedian>;

std::string number(double value, const char* format) {
    if (!std::isfinite(value)) return "-";
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

// Distances in 1e-4 of the diagonal, two digits that say something.
std::string distance(double value) {
    const double scaled = 1e4 * value;
    if (!(scaled < 99.5)) return number(scaled, "%.0f");
    return number(scaled, scaled < 9.95 ? (scaled < 0.995 ? "%.2f" : "%.1f") : "%.0f");
}

std::string percent(double share) {
    return number(100 * share, "%g") + " %";
}

template <class Field>
auto distinct(const Medians& medians, const Field& field) {
    std::vector<std::decay_t<decltype(field(medians.front()))>> values;
    for (const ComparisonMedian& m : medians) {
        if (std::find(values.begin(), values.end(), field(m)) == values.end()) {
            values.push_back(field(m));
        }
    }
    return values;
}

void write_head(std::ostream& out, const std::string& first, const std::vector<double>& shares) {
    out << first;
    for (const double share : shares) out << ' ' << percent(share) << " |";
    const auto columns = static_cast<std::size_t>(std::count(first.begin(), first.end(), '|')) - 1;
    out << "\n|";
    for (std::size_t k = 0; k < columns + shares.size(); ++k) out << " --- |";
    out << '\n';
}

// rms, and behind it how many of the runs are not as they should be.
std::string cell(const ComparisonMedian* m) {
    if (m == nullptr) return "";
    if (std::isnan(m->rms)) return "nothing";
    std::string text = distance(m->rms);
    if (m->right < m->runs) {
        text.append(" (").append(std::to_string(m->right)).append("/");
        text.append(std::to_string(m->runs)).append(")");
    }
    return text;
}

// A table whose columns are values of `axis`.
template <class Axis>
void write_by_model(std::ostream& out, const Medians& medians, const Axis& axis) {
    std::vector<double> shares = distinct(medians, axis);
    std::sort(shares.begin(), shares.end());
    const auto methods = distinct(medians, [](const auto& m) { return m.method; });
    write_head(out, "| model | method |", shares);
    for (const std::string& model : distinct(medians, [](const auto& m) { return m.model; })) {
        for (const std::string& method : methods) {
            std::string line = "| ";
            line.append(model).append(" | ").append(method).append(" |");
            bool any = false;
            for (const double share : shares) {
                const auto it = std::find_if(medians.begin(), medians.end(), [&](const auto& m) {
                    return m.model == model && m.method == method && axis(m) == share;
                });
                any = any || it != medians.end();
                line.append(" ").append(cell(it == medians.end() ? nullptr : &*it)).append(" |");
            }
            if (any) out << line << '\n';
        }
    }
}

// Over the models, for one method at one share.
struct OverModels {
    double log_sum = 0;
    double worst = 0;
    std::size_t count = 0;
    std::size_t models = 0;
    std::size_t right = 0;
    std::size_t runs = 0;
    double worst_max = 0;
    double worst_intersections = ComparisonRow::kNone;

    void take(const ComparisonMedian& m) {
        ++models;
        right += m.right;
        runs += m.runs;
        if (m.to_floor > 0) {
            log_sum += std::log(m.to_floor);
            worst = std::max(worst, m.to_floor);
            worst_max = std::max(worst_max, m.max_to_floor);
            ++count;
        }
        if (!(worst_intersections >= m.self_intersecting_faces)) {
            worst_intersections = m.self_intersecting_faces;
        }
    }
};

struct Summary {
    const char* title;
    std::function<std::string(const OverModels&)> text;
};

const std::vector<Summary> kSummaries{
    {"rms over the floor's: geometric mean over the models (the worst model)",
     [](const OverModels& o) {
         if (o.count == 0) return std::string("-");
         // Fewer models than there are: the rest have nothing to show, or an exact floor.
         std::string text = number(std::exp(o.log_sum / static_cast<double>(o.count)), "%.2f") +
                            " (" + number(o.worst, "%.2f") + ")";
         if (o.count < o.models) text += " of " + std::to_string(o.count);
         return text;
     }},
    {"Max error over the floor's, worst model",
     [](const OverModels& o) { return o.count == 0 ? "-" : number(o.worst_max, "%.2f"); }},
    {"Runs with the right topology",
     [](const OverModels& o) { return std::to_string(o.right) + "/" + std::to_string(o.runs); }},
    {"Self-intersecting faces, median of the seeds, worst model",
     [](const OverModels& o) { return number(o.worst_intersections, "%.0f"); }}};

void write_summary(std::ostream& out, const Medians& medians, const Summary& summary) {
    std::vector<double> losses = distinct(medians, [](const auto& m) { return m.loss; });
    std::sort(losses.begin(), losses.end());
    out << '\n' << summary.title << ":\n\n";
    write_head(out, "| method |", losses);
    for (const std::string& method : distinct(medians, [](const auto& m) { return m.method; })) {
        out << "| " << method << " |";
        for (const double loss : losses) {
            OverModels over;
            for (const ComparisonMedian& m : medians) {
                if (m.method == method && m.loss == loss) over.take(m);
            }
            out << ' ' << summary.text(over) << " |";
        }
        out << '\n';
    }
}

void write_bytes(std::ostream& out, const Medians& medians) {
    const auto models = distinct(medians, [](const auto& m) { return m.model; });
    out << "\nBytes of each method's stream:\n\n| method |";
    for (const std::string& model : models) out << ' ' << model << " |";
    out << "\n|";
    for (std::size_t k = 0; k <= models.size(); ++k) out << " --- |";
    out << '\n';
    for (const std::string& method : distinct(medians, [](const auto& m) { return m.method; })) {
        out << "| " << method << " |";
        for (const std::string& model : models) {
            const auto it = std::find_if(medians.begin(), medians.end(), [&](const auto& m) {
                return m.model == model && m.method == method;
            });
            out << ' ' << (it == medians.end() ? "" : number(it->stream_bytes, "%.0f")) << " |";
        }
        out << '\n';
    }
}

}  // namespace

void write_markdown(std::ostream& out, const Medians& medians) {
    Medians whole;
    Medians partial;
    for (const ComparisonMedian& m : medians) (m.sent == 1 ? whole : partial).push_back(m);
    if (!whole.empty()) {
        out << "rms in 1e-4 of the diagonal by datagrams lost, median of the seeds; in brackets "
               "the runs with the right topology where not all are:\n\n";
        write_by_model(out, whole, [](const auto& m) { return m.loss; });
        for (const Summary& summary : kSummaries) write_summary(out, whole, summary);
        write_bytes(out, whole);
    }
    for (const double loss : distinct(partial, [](const auto& m) { return m.loss; })) {
        Medians curve;  // its end is among the whole ones
        for (const ComparisonMedian& m : medians) {
            if (m.loss == loss) curve.push_back(m);
        }
        out << "\nrms in 1e-4 by the share of the stream that was sent, " << percent(loss)
            << " of it lost:\n\n";
        write_by_model(out, curve, [](const auto& m) { return m.sent; });
    }
}

}  // namespace ellicast::tests
