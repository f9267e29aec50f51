// receiver/confidence.cpp
#include "receiver/confidence.hpp"

#include <algorithm>
#include <cassert>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <span>
#include <utility>

#include "common/parallel.hpp"
#include "receiver/vertex_neighbours.hpp"

namespace ellicast::receiver {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

constexpr std::uint32_t kNoCell = 0xffffffffU;
// Cells are not compared with what is smaller than this share of the mean cell: slivers.
constexpr double kLeastUsualArea = 1e-3;

// Cell k is what lies nearest to received[k].
struct Cells {
    std::vector<double> distance;     // of each vertex; infinite where none is reached
    std::vector<std::uint32_t> cell;  // of each vertex; kNoCell there
};

// Dijkstra's algorithm from all received vertices at once. What they reach directly is most of the
// mesh; it is sorted once, and only what is reached from there stands in a queue.
class CellSearch {
  public:
    CellSearch(const TriangleMesh& mesh, const VertexNeighbours& neighbours)
        : mesh_(mesh),
          neighbours_(neighbours),
          cells_{std::vector<double>(mesh.positions.size(), kUnreached),
                 std::vector<std::uint32_t>(mesh.positions.size(), kNoCell)} {}

    Cells from(const std::vector<std::uint32_t>& received) {
        for (std::uint32_t k = 0; k < received.size(); ++k) {
            cells_.distance[received[k]] = 0.0;
            cells_.cell[received[k]] = k;
        }
        std::vector<Entry> sources;
        sources.reserve(received.size());
        for (const std::uint32_t v : received) sources.emplace_back(0.0, v);
        std::vector<std::uint32_t> reached;
        visit(sources, [&](double d, std::uint32_t u, bool first) {
            if (!(d > 0.0)) {
                front_.emplace(d, u);  // coincides with a received vertex
            } else if (first) {
                reached.push_back(u);
            }
        });
        std::vector<Entry> ring;
        ring.reserve(reached.size());
        for (const std::uint32_t u : reached) ring.emplace_back(cells_.distance[u], u);
        std::sort(ring.begin(), ring.end());
        visit(ring, [&](double d, std::uint32_t u, bool) { front_.emplace(d, u); });
        return std::move(cells_);
    }

  private:
    using Entry = std::pair<double, std::uint32_t>;
    static constexpr double kUnreached = std::numeric_limits<double>::infinity();

    // Goes through `sorted` and the queue, the nearest first. Calls enqueue(d, u, first) for a
    // vertex u to which a shorter way was found, or the first one.
    template <class Enqueue>
    void visit(const std::vector<Entry>& sorted, const Enqueue& enqueue) {
        auto next = sorted.begin();
        while (next != sorted.end() || !front_.empty()) {
            if (next != sorted.end() && (front_.empty() || *next < front_.top())) {
                leave(*next++, enqueue);
            } else {
                const Entry nearest = front_.top();
                front_.pop();
                leave(nearest, enqueue);
            }
        }
    }

    template <class Enqueue>
    void leave(const Entry& entry, const Enqueue& enqueue) {
        const auto [d, v] = entry;
        if (d > cells_.distance[v]) return;  // a shorter way was found meanwhile
        for (const std::uint32_t u : neighbours_.of(v)) {
            const double before = cells_.distance[u];
            if (!(d < before)) continue;
            const double through_v = d + (mesh_.positions[u] - mesh_.positions[v]).norm();
            if (!(through_v < before)) continue;
            cells_.distance[u] = through_v;
            cells_.cell[u] = cells_.cell[v];
            enqueue(through_v, u, before == kUnreached);
        }
    }

    const TriangleMesh& mesh_;
    const VertexNeighbours& neighbours_;
    Cells cells_;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front_;
};

double area_of(const TriangleMesh& mesh, const Triangle& t) {
    const Vector3d& p = mesh.positions[t[0]];
    return 0.5 * (mesh.positions[t[1]] - p).cross(mesh.positions[t[2]] - p).norm();
}

// Of each vertex: a third of the triangles around it.
std::vector<double> vertex_areas(const TriangleMesh& mesh) {
    std::vector<double> areas(mesh.positions.size(), 0.0);
    for (const Triangle& t : mesh.triangles) {
        const double third = area_of(mesh, t) / 3.0;
        for (const std::uint32_t v : t) areas[v] += third;
    }
    return areas;
}

// Which cells touch: those of cell k from first[k] to first[k + 1], some more than once.
struct CellNeighbours {
    std::vector<std::size_t> first;
    std::vector<std::uint32_t> cells;

    [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t k) const {
        return {cells.data() + first[k], first[k + 1] - first[k]};
    }
};

// Calls visit(a, b) for every side of a triangle that leads from cell a to another cell b. In a
// closed mesh the triangle beyond has the same side the other way round.
template <class Visit>
void for_each_crossing(const TriangleMesh& mesh, const std::vector<std::uint32_t>& cell,
                       const Visit& visit) {
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t a = cell[t[c]];
            const std::uint32_t b = cell[t[(c + 1) % 3]];
            if (a != b && a != kNoCell && b != kNoCell) visit(a, b);
        }
    }
}

CellNeighbours touching_cells(const TriangleMesh& mesh, const std::vector<std::uint32_t>& cell,
                              std::size_t count) {
    CellNeighbours result;
    result.first.assign(count + 1, 0);
    for_each_crossing(mesh, cell, [&](std::uint32_t a, std::uint32_t) { ++result.first[a + 1]; });
    std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
    result.cells.resize(result.first.back());
    std::vector<std::size_t> next(result.first.begin(), result.first.end() - 1);
    for_each_crossing(mesh, cell,
                      [&](std::uint32_t a, std::uint32_t b) { result.cells[next[a]++] = b; });
    return result;
}

double lower_quartile(std::vector<double>& values) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 4);
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

// q: for each cell the lower quartile of the areas within two steps of it.
std::vector<double> usual_areas(const std::vector<double>& areas, const CellNeighbours& touching,
                                unsigned threads) {
    std::vector<double> usual(areas.size());
    common::parallel_for(areas.size(), threads, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> asked_by(areas.size(), kNoCell);  // so that each counts once
        std::vector<double> values;
        for (std::size_t k = begin; k < end; ++k) {
            const auto cell = static_cast<std::uint32_t>(k);
            values.clear();
            const auto add = [&](std::uint32_t other) {
                if (asked_by[other] != cell) values.push_back(areas[other]);
                asked_by[other] = cell;
            };
            add(cell);
            for (const std::uint32_t near : touching.of(cell)) {
                add(near);
                for (const std::uint32_t beyond : touching.of(near)) add(beyond);
            }
            usual[k] = lower_quartile(values);
        }
    });
    return usual;
}

// The c > 0 with   sum of max(0, s_i / c - 1)  +  unreached / c  =  missing.   The left side falls
// with c, and between neighbouring s_i it is (S + unreached) / c - k with the k larger ones and
// their sum S.
double solve_for_scale(std::vector<double> s, double unreached, double missing) {
    assert(missing > 0.0);
    std::sort(s.begin(), s.end(), std::greater<>());
    double sum = unreached;
    double c = sum / missing;
    for (std::size_t k = 0; k < s.size() && s[k] > c; ++k) {
        sum += s[k];
        c = sum / (static_cast<double>(k + 1) + missing);
    }
    return c;
}

// The header's a, q and m, from the areas of vertices to the expected vertices at each.
class Expectation {
  public:
    Expectation(const TriangleMesh& mesh, const Cells& cells, std::size_t received)
        : mesh_(mesh), cells_(cells), vertex_area_(vertex_areas(mesh)), area_(received, 0.0) {
        for (std::size_t v = 0; v < vertex_area_.size(); ++v) {
            const std::uint32_t cell = cells.cell[v];
            (cell == kNoCell ? unreached_ : area_[cell]) += vertex_area_[v];
        }
    }

    // Per vertex.
    [[nodiscard]] std::vector<double> of_vertices(std::uint64_t missing, unsigned threads) const {
        const Shares shares = compare(threads);
        const double c =
            solve_for_scale(shares.of_cell, shares.unreached, static_cast<double>(missing));
        std::vector<double> expected(vertex_area_.size(), 0.0);
        for (std::size_t v = 0; v < expected.size(); ++v) {
            const std::uint32_t cell = cells_.cell[v];
            if (cell == kNoCell) {
                if (unreached_ > 0.0) {
                    expected[v] = shares.unreached / c * (vertex_area_[v] / unreached_);
                }
            } else {
                const double in_cell = std::max(1.0, shares.of_cell[cell] / c);  // 1 + m
                const bool flat = !(area_[cell] > 0.0);
                const double part =
                    flat ? (cells_.distance[v] == 0.0 ? 1.0 : 0.0) : vertex_area_[v] / area_[cell];
                expected[v] = in_cell * part;
            }
        }
        return expected;
    }

  private:
    // Areas as multiples of what is usual: s = a / q.
    struct Shares {
        std::vector<double> of_cell;
        double unreached = 0.0;
    };

    [[nodiscard]] Shares compare(unsigned threads) const {
        Shares shares;
        if (area_.empty()) {
            shares.unreached = 1.0;
            return shares;
        }
        std::vector<double> usual =
            usual_areas(area_, touching_cells(mesh_, cells_.cell, area_.size()), threads);
        const double mean =
            std::accumulate(area_.begin(), area_.end(), 0.0) / static_cast<double>(area_.size());
        for (std::size_t k = 0; k < area_.size(); ++k) {
            const double q = std::max(usual[k], kLeastUsualArea * mean);
            shares.of_cell.push_back(q > 0.0 ? area_[k] / q : 1.0);
        }
        const double q = std::max(lower_quartile(usual), kLeastUsualArea * mean);
        if (unreached_ > 0.0) shares.unreached = q > 0.0 ? unreached_ / q : 1.0;
        return shares;
    }

    const TriangleMesh& mesh_;
    const Cells& cells_;
    std::vector<double> vertex_area_;
    std::vector<double> area_;  // of cells
    double unreached_ = 0.0;    // area
};

// Each vertex gives equal shares of what it has to its neighbours and to itself.
std::vector<double> spread_once(const std::vector<double>& amounts,
                                const VertexNeighbours& neighbours, unsigned threads) {
    std::vector<double> result(amounts.size());
    const auto part = [&](std::uint32_t v) {
        return amounts[v] / static_cast<double>(neighbours.of(v).size() + 1);
    };
    common::parallel_for(amounts.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto v = static_cast<std::uint32_t>(k);
            double sum = part(v);
            for (const std::uint32_t u : neighbours.of(v)) sum += part(u);
            result[k] = sum;
        }
    });
    return result;
}

// Distance of a triangle's centre.
double distance_of(const TriangleMesh& mesh, const std::vector<float>& distance, const Triangle& t,
                   const Vector3d& center) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::uint32_t v : t) {
        nearest = std::min(nearest,
                           static_cast<double>(distance[v]) + (mesh.positions[v] - center).norm());
    }
    return nearest;
}

// The summary's gap and shares, from the distances of triangles.
void measure_gaps(const Confidence& confidence, const TriangleMesh& mesh,
                  ConfidenceSummary& summary) {
    double area = 0.0;
    Gap gap;
    for (const Triangle& t : mesh.triangles) {
        const Vector3d center =
            (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
        const double distance = distance_of(mesh, confidence.distance, t, center);
        const double here = area_of(mesh, t);
        area += here;
        for (FartherShare& farther : summary.farther) {
            if (distance > farther.distance) farther.share += here;
        }
        if (distance > gap.radius) gap = {center, distance};
    }
    for (FartherShare& farther : summary.farther) {
        farther.share = area > 0.0 ? farther.share / area : 0.0;
    }
    if (gap.radius > 0.0) summary.largest_gap = gap;
}

std::size_t octant_of(const Vector3d& x, const Vector3d& middle) {
    std::size_t octant = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (x[axis] > middle[axis]) octant |= std::size_t{1} << axis;
    }
    return octant;
}

}  // namespace

Confidence measure_confidence(const TriangleMesh& mesh, const std::vector<std::uint32_t>& received,
                              std::uint64_t missing, unsigned threads) {
    assert(std::is_sorted(received.begin(), received.end()));
    assert(received.empty() || received.back() < mesh.positions.size());
    const std::size_t n = mesh.positions.size();
    const VertexNeighbours neighbours(mesh);
    const Cells cells = CellSearch(mesh, neighbours).from(received);
    Confidence result;
    result.distance.reserve(n);
    const double farthest = n > 0 ? common::bounding_box(mesh.positions).diagonal().norm() : 0.0;
    for (const double d : cells.distance) {
        result.distance.push_back(static_cast<float>(std::min(d, farthest)));
    }
    std::vector<double> have(n, 0.0);
    for (const std::uint32_t v : received) have[v] = 1.0;
    if (missing == 0) {
        result.completeness.assign(n, 1.0F);
        result.expected.assign(have.begin(), have.end());
        return result;
    }
    std::vector<double> expected =
        Expectation(mesh, cells, received.size()).of_vertices(missing, threads);
    result.expected.assign(expected.begin(), expected.end());
    for (int step = 0; step < kSpreadingSteps; ++step) {
        have = spread_once(have, neighbours, threads);
        expected = spread_once(expected, neighbours, threads);
    }
    result.completeness.reserve(n);
    for (std::size_t v = 0; v < n; ++v) {
        const bool all = have[v] >= expected[v] && have[v] > 0.0;
        const double share = expected[v] > 0.0 ? have[v] / expected[v] : 0.0;
        result.completeness.push_back(all ? 1.0F : static_cast<float>(share));
    }
    return result;
}

ConfidenceSummary summarise(const Confidence& confidence, const TriangleMesh& mesh,
                            const std::vector<std::uint32_t>& received, std::uint64_t missing,
                            const Eigen::AlignedBox3d& box) {
    ConfidenceSummary summary;
    summary.missing = missing;
    for (std::size_t k = 0; k < kFartherThan.size(); ++k) {
        summary.farther[k].distance = kFartherThan[k] * box.diagonal().norm();
    }
    measure_gaps(confidence, mesh, summary);
    if (missing == 0) summary.largest_gap.reset();
    const Vector3d middle = box.center();
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        summary.octants[octant_of(mesh.positions[v], middle)].expected +=
            static_cast<double>(confidence.expected[v]);
    }
    for (const std::uint32_t v : received) {
        ++summary.octants[octant_of(mesh.positions[v], middle)].received;
    }
    return summary;
}

}  // namespace ellicast::receiver
