// tests/support/comparison_table.cpp
#include "tests/support/comparison_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <istream>
#include <map>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <tuple>

namespace ellicast::tests {
namespace {

constexpr const char* kColumns =
    "model,method,loss,sent,seed,vertices,ellipsoids,bytes,stream_bytes,rms,rms_to,rms_from,mean,"
    "max,normal_deg,components,genus,closed,manifold,topology_right,left_over,"
    "self_intersecting_faces,cpu_seconds";

std::string text_of(double value, const char* format = "%.6g") {
    if (!std::isfinite(value)) return "nan";
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

// Reads the fields of one line from left to right.
class Fields {
  public:
    explicit Fields(const std::string& line) : line_(line), stream_(line) {}

    std::string text() {
        std::string field;
        if (!std::getline(stream_, field, ',') || field.empty()) fail();
        return field;
    }
    double number() {
        const std::string field = text();
        std::size_t used = 0;
        double value = 0;
        try {
            value = std::stod(field, &used);
        } catch (const std::logic_error&) {
            fail();
        }
        if (used != field.size()) fail();
        return value;
    }
    template <class T>
    T integer() {
        const double value = number();
        if (value != std::floor(value)) fail();
        return static_cast<T>(value);
    }
    void end() {
        std::string more;
        if (std::getline(stream_, more)) fail();
    }

  private:
    [[noreturn]] void fail() const { throw std::runtime_error("no row of a comparison: " + line_); }
    std::string line_;
    std::istringstream stream_;
};

// Below this share of the diagonal there is no error, and no ratio to it.
constexpr double kExact = 1e-9;

double infinite_if_none(double value) {
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
}

// NaN for none, and where the middle is infinite.
double median(std::vector<double> values) {
    std::erase_if(values, [](double value) { return std::isnan(value); });
    if (values.empty()) return ComparisonRow::kNone;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    const double middle =
        values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
    return std::isfinite(middle) ? middle : ComparisonRow::kNone;
}

template <class Field>
std::vector<double> column(const std::vector<const ComparisonRow*>& rows, const Field& field) {
    std::vector<double> values;
    for (const ComparisonRow* row : rows) values.push_back(static_cast<double>(field(*row)));
    return values;
}

ComparisonMedian median_of(const std::vector<const ComparisonRow*>& rows) {
    ComparisonMedian m;
    const ComparisonRow& first = *rows.front();
    std::tie(m.model, m.method, m.loss, m.sent) =
        std::tie(first.model, first.method, first.loss, first.sent);
    m.runs = rows.size();
    for (const ComparisonRow* row : rows) {
        m.surfaces += row->has_surface();
        m.right += row->topology_right;
    }
    std::vector<double> rms = column(rows, [](const auto& r) { return infinite_if_none(r.rms); });
    m.rms = median(rms);
    std::erase_if(rms, [](double value) { return std::isinf(value); });
    if (!rms.empty()) {
        m.rms_least = *std::min_element(rms.begin(), rms.end());
        m.rms_largest = *std::max_element(rms.begin(), rms.end());
    }
    m.max = median(column(rows, [](const auto& r) { return infinite_if_none(r.max); }));
    m.vertices = median(column(rows, [](const auto& r) { return r.vertices; }));
    m.bytes = median(column(rows, [](const auto& r) { return r.bytes; }));
    m.stream_bytes = median(column(rows, [](const auto& r) { return r.stream_bytes; }));
    m.self_intersecting_faces =
        median(column(rows, [](const auto& r) { return r.self_intersecting_faces; }));
    m.cpu_seconds = median(column(rows, [](const auto& r) { return r.cpu_seconds; }));
    return m;
}

}  // namespace

void write_csv_header(std::ostream& out) {
    out << kColumns << '\n';
}

void write_csv(std::ostream& out, const ComparisonRow& r) {
    out << r.model << ',' << r.method << ',' << text_of(r.loss) << ',' << text_of(r.sent) << ','
        << r.seed << ',' << r.vertices << ',' << r.ellipsoids << ',' << r.bytes << ','
        << r.stream_bytes;
    for (const double value : {r.rms, r.rms_to, r.rms_from, r.mean, r.max, r.normal_deg}) {
        out << ',' << text_of(value);
    }
    out << ',' << r.components << ',' << r.genus << ',' << r.closed << ',' << r.manifold << ','
        << r.topology_right << ',' << r.left_over << ',' << text_of(r.self_intersecting_faces)
        << ',' << text_of(r.cpu_seconds) << '\n';
}

std::vector<ComparisonRow> read_csv(std::istream& in) {
    std::string line;
    if (!std::getline(in, line) || line != kColumns) {
        throw std::runtime_error("no table of a comparison: " + line);
    }
    std::vector<ComparisonRow> rows;
    while (std::getline(in, line)) {
        Fields fields(line);
        ComparisonRow& r = rows.emplace_back();
        r.model = fields.text();
        r.method = fields.text();
        r.loss = fields.number();
        r.sent = fields.number();
        r.seed = fields.integer<unsigned>();
        for (std::uint64_t* value : {&r.vertices, &r.ellipsoids, &r.bytes, &r.stream_bytes}) {
            *value = fields.integer<std::uint64_t>();
        }
        for (double* value : {&r.rms, &r.rms_to, &r.rms_from, &r.mean, &r.max, &r.normal_deg}) {
            *value = fields.number();
        }
        r.components = fields.integer<std::size_t>();
        r.genus = fields.integer<std::int64_t>();
        for (bool* value : {&r.closed, &r.manifold, &r.topology_right}) {
            *value = fields.integer<int>() != 0;
        }
        r.left_over = fields.integer<std::uint64_t>();
        r.self_intersecting_faces = fields.number();
        r.cpu_seconds = fields.number();
        fields.end();
    }
    return rows;
}

std::vector<ComparisonMedian> medians_of(const std::vector<ComparisonRow>& rows) {
    using Key = std::tuple<std::string, std::string, double, double>;
    std::map<Key, std::size_t> place;
    std::vector<std::vector<const ComparisonRow*>> groups;
    for (const ComparisonRow& row : rows) {
        const auto [it, inserted] =
            place.try_emplace({row.model, row.method, row.loss, row.sent}, groups.size());
        if (inserted) groups.emplace_back();
        groups[it->second].push_back(&row);
    }
    std::vector<ComparisonMedian> medians;
    medians.reserve(groups.size());
    for (const auto& group : groups) medians.push_back(median_of(group));
    for (ComparisonMedian& m : medians) {
        const auto floor = place.find({m.model, "floor", m.loss, m.sent});
        if (floor == place.end()) continue;
        const ComparisonMedian& reference = medians[floor->second];
        if (reference.rms > kExact) m.to_floor = m.rms / reference.rms;
        if (reference.max > kExact) m.max_to_floor = m.max / reference.max;
    }
    return medians;
}

void write_medians(std::ostream& out, const std::vector<ComparisonMedian>& medians) {
    out << "model,method,loss,sent,runs,surfaces,right,rms,rms_least,rms_largest,max,vertices,"
           "bytes,stream_bytes,self_intersecting_faces,cpu_seconds,to_floor,max_to_floor\n";
    for (const ComparisonMedian& m : medians) {
        out << m.model << ',' << m.method << ',' << text_of(m.loss) << ',' << text_of(m.sent) << ','
            << m.runs << ',' << m.surfaces << ',' << m.right;
        for (const double value :
             {m.rms, m.rms_least, m.rms_largest, m.max, m.vertices, m.bytes, m.stream_bytes,
              m.self_intersecting_faces, m.cpu_seconds, m.to_floor, m.max_to_floor}) {
            out << ',' << text_of(value);
        }
        out << '\n';
    }
}

}  // namespace ellicast::tests
