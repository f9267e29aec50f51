// sender/diagonal_marks.cpp
#include "sender/diagonal_marks.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "common/diagonal_choice.hpp"
#include "common/parallel.hpp"
#include "sender/diagonal_quads.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

// Diagonals whose mistake adds less than this share of what all mistakes add are left alone: each
// mark coarsens a normal.
constexpr double kLeastShare = 1e-4;

// The edges of the solid, and what is known of each.
struct Edges {
    std::vector<HalfEdge> half_edge;
    std::vector<double> gain;  // of the other diagonal by the rule, in mean edge lengths
    std::vector<double> cost;  // when the receiver takes the other one
};

Edges edges_of(const TriangleMesh& solid, const Quads& quads, std::uint8_t rule, unsigned threads) {
    const double unit = common::mean_edge_length(solid);
    const common::DiagonalWeights weights = common::diagonal_weights(rule, true, 0.0);
    Edges edges;
    edges.half_edge.reserve(quads.half_edges() / 2);
    for (HalfEdge h = 0; h < quads.half_edges(); ++h) {
        if (quads.has_quad(h)) edges.half_edge.push_back(h);
    }
    edges.gain.resize(edges.half_edge.size());
    edges.cost.resize(edges.half_edge.size());
    common::parallel_for(edges.gain.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) {
            const HalfEdge h = edges.half_edge[e];
            edges.gain[e] = common::weighed_diagonal_gain(quads.quad(h), weights, unit) / unit;
            edges.cost[e] = quads.wrong_diagonal(h);
        }
    });
    return edges;
}

class Marking {
  public:
    Marking(std::size_t vertices, const Quads& quads, const Edges& edges, double weight)
        : weight_(weight),
          quads_(quads),
          edges_(edges),
          marks_(vertices, 0),
          suspects_(wrong_and_costly()),
          quads_at_(corners_in_quads()) {}

    std::vector<char> run() {
        for (const std::uint32_t e : suspects_) try_marking(e);
        return std::move(marks_);
    }

  private:
    // Those that count, the costliest first. Sets least_.
    std::vector<std::uint32_t> wrong_and_costly() {
        std::vector<std::uint32_t> wrong;
        for (std::uint32_t e = 0; e < edges_.gain.size(); ++e) {
            if (cost(e) > 0.0) wrong.push_back(e);
        }
        std::stable_sort(wrong.begin(), wrong.end(), [&](std::uint32_t a, std::uint32_t b) {
            return edges_.cost[a] > edges_.cost[b];
        });
        for (const std::uint32_t e : wrong) least_ += kLeastShare * edges_.cost[e];
        const auto cheap = std::find_if(wrong.begin(), wrong.end(),
                                        [&](std::uint32_t e) { return edges_.cost[e] < least_; });
        wrong.erase(cheap, wrong.end());
        return wrong;
    }

    // A corner of an edge's quad: vertex, edge.
    using Corner = std::pair<std::uint32_t, std::uint32_t>;

    // By vertex, then edge, of the vertices that may be marked: few, so that what is asked of the
    // quads around them takes little memory.
    [[nodiscard]] std::vector<Corner> corners_in_quads() const {
        std::vector<bool> asked(marks_.size(), false);
        for (const std::uint32_t e : suspects_) {
            const std::array<std::uint32_t, 4> id = ids(e);
            asked[id[0]] = asked[id[1]] = true;
        }
        std::vector<Corner> corners;
        for (std::uint32_t e = 0; e < edges_.gain.size(); ++e) {
            for (const std::uint32_t v : ids(e)) {
                if (asked[v]) corners.emplace_back(v, e);
            }
        }
        std::sort(corners.begin(), corners.end());
        return corners;
    }

    [[nodiscard]] std::array<std::uint32_t, 4> ids(std::uint32_t e) const {
        return quads_.ids(edges_.half_edge[e]);
    }

    [[nodiscard]] bool marked(std::uint32_t a, std::uint32_t b) const {
        return marks_[a] != 0 && marks_[b] != 0;
    }

    // What the edge costs with the marks as they are.
    [[nodiscard]] double cost(std::uint32_t e) const {
        const auto [a, b, c, d] = ids(e);
        const double gain = edges_.gain[e] + weight_ * (int{marked(c, d)} - int{marked(a, b)});
        return gain > common::kLeastDiagonalGain ? edges_.cost[e] : 0.0;
    }

    // Of all quads that one of the two vertices has a part in.
    [[nodiscard]] double cost_around(std::uint32_t a, std::uint32_t b) const {
        double sum = 0.0;
        for (const std::uint32_t v : {a, b}) {
            auto corner = std::lower_bound(quads_at_.begin(), quads_at_.end(), Corner{v, 0});
            for (; corner != quads_at_.end() && corner->first == v; ++corner) {
                const std::uint32_t e = corner->second;
                const std::array<std::uint32_t, 4> id = ids(e);
                const bool seen = v == b && std::find(id.begin(), id.end(), a) != id.end();
                if (!seen) sum += cost(e);
            }
        }
        return sum;
    }

    void try_marking(std::uint32_t e) {
        const std::array<std::uint32_t, 4> id = ids(e);
        const auto [a, b] = std::pair(id[0], id[1]);
        if (marked(a, b)) return;
        const auto before = std::pair(marks_[a], marks_[b]);
        const double cost_before = cost_around(a, b);
        marks_[a] = marks_[b] = 1;
        if (cost_around(a, b) < cost_before - least_) return;
        std::tie(marks_[a], marks_[b]) = before;
    }

    double weight_;  // of a mark, in mean edge lengths
    const Quads& quads_;
    const Edges& edges_;
    std::vector<char> marks_;
    double least_ = 0.0;                   // what a mistake must cost
    std::vector<std::uint32_t> suspects_;  // edges
    std::vector<Corner> quads_at_;
};

}  // namespace

std::vector<char> diagonal_marks(const TriangleMesh& solid, int normal_bits, std::uint8_t rule,
                                 unsigned threads) {
    const std::vector<Vector3d> normals = received_normals(solid, normal_bits, threads);
    return diagonal_marks(solid, Quads(solid, normals), rule, threads);
}

std::vector<char> diagonal_marks(const TriangleMesh& solid, const Quads& quads, std::uint8_t rule,
                                 unsigned threads) {
    const double weight = common::diagonal_weights(rule, true, 0.0).mark;
    const Edges edges = edges_of(solid, quads, rule, threads);
    return Marking(solid.positions.size(), quads, edges, weight).run();
}

}  // namespace ellicast::sender
