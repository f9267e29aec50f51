// sender/diagonal_marks.cpp
#include "sender/diagonal_marks.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "common/diagonal_choice.hpp"
#include "common/parallel.hpp"
#include "sender/diagonal_quads.hpp"
#include "sender/diagonal_rule.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

// Diagonals whose mistake adds less than this share of what all mistakes add are left alone: each
// mark coarsens a normal.
constexpr double kLeastShare = 1e-4;

// Half-edges that are looked at together, whoever does it.
constexpr std::size_t kPart = 1u << 13;

/// What is known of some edges of the solid.
struct Edges {
    std::vector<HalfEdge> half_edge;
    std::vector<double> gain;  // of the other diagonal by the rule, in mean edge lengths
    std::vector<double> cost;  // when the receiver takes the other one
};

/// Which diagonals a receiver without marks gets wrong.
class Guesses {
  public:
    Guesses(const TriangleMesh& solid, const Quads& quads, std::uint8_t rule, unsigned threads)
        : quads_(quads),
          weights_(common::diagonal_weights(rule, true, 0.0)),
          unit_(common::mean_edge_length(solid)),
          threads_(threads) {}

    /// Ascending; those that cost at least so much, and something.
    [[nodiscard]] std::vector<HalfEdge> costly_mistakes(double least) const {
        return chosen([&](HalfEdge h) {
            const double cost = quads_.wrong_diagonal(h);
            return cost > 0.0 && cost >= least && is_wrong(gain(h));
        });
    }

    /// Of the edges whose quads have one of these vertices, by half-edge.
    [[nodiscard]] Edges around(const std::vector<bool>& vertices) const {
        Edges edges;
        edges.half_edge = chosen([&](HalfEdge h) {
            const std::array<std::uint32_t, 4> id = quads_.ids(h);
            return std::any_of(id.begin(), id.end(), [&](auto v) { return vertices[v]; });
        });
        edges.gain.resize(edges.half_edge.size());
        edges.cost.resize(edges.half_edge.size());
        common::parallel_for(edges.gain.size(), threads_, [&](std::size_t begin, std::size_t end) {
            for (std::size_t e = begin; e < end; ++e) {
                edges.gain[e] = gain(edges.half_edge[e]);
                edges.cost[e] = quads_.wrong_diagonal(edges.half_edge[e]);
            }
        });
        return edges;
    }

    static bool is_wrong(double gain) { return gain > common::kLeastDiagonalGain; }

  private:
    [[nodiscard]] double gain(HalfEdge h) const {
        return common::weighed_diagonal_gain(quads_.quad(h), weights_, unit_) / unit_;
    }

    template <class Wanted>
    [[nodiscard]] std::vector<HalfEdge> chosen(const Wanted& wanted) const {
        const auto look = [&](std::size_t begin, std::size_t end) {
            std::vector<HalfEdge> found;
            for (auto h = static_cast<HalfEdge>(begin); h < end; ++h) {
                if (quads_.has_quad(h) && wanted(h)) found.push_back(h);
            }
            return found;
        };
        return common::joined(common::in_parts(quads_.half_edges(), kPart, threads_, look));
    }

    const Quads& quads_;
    common::DiagonalWeights weights_;
    double unit_;
    unsigned threads_;
};

/// Tries marks on the costliest edges first.
class Marking {
  public:
    Marking(std::size_t vertices, const Quads& quads, const Guesses& guesses, double weight,
            double least)
        : weight_(weight), quads_(quads), marks_(vertices, 0), least_(least) {
        const std::vector<HalfEdge> mistakes = guesses.costly_mistakes(least_);
        std::vector<bool> asked(vertices, false);
        for (const HalfEdge h : mistakes) {
            const std::array<std::uint32_t, 4> id = quads_.ids(h);
            asked[id[0]] = asked[id[1]] = true;
        }
        edges_ = guesses.around(asked);
        for (std::uint32_t e = 0; e < edges_.gain.size(); ++e) {
            if (std::binary_search(mistakes.begin(), mistakes.end(), edges_.half_edge[e])) {
                suspects_.push_back(e);
            }
            for (const std::uint32_t v : ids(e)) {
                if (asked[v]) quads_at_.emplace_back(v, e);
            }
        }
        std::sort(quads_at_.begin(), quads_at_.end());
        std::stable_sort(suspects_.begin(), suspects_.end(), [&](std::uint32_t a, std::uint32_t b) {
            return edges_.cost[a] > edges_.cost[b];
        });
    }

    std::vector<char> run() {
        for (const std::uint32_t e : suspects_) try_marking(e);
        return std::move(marks_);
    }

  private:
    // A corner of an edge's quad: vertex, edge.
    using Corner = std::pair<std::uint32_t, std::uint32_t>;

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
        return Guesses::is_wrong(gain) ? edges_.cost[e] : 0.0;
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
    std::vector<char> marks_;
    double least_;                         // what a mistake must cost
    Edges edges_;                          // around those that may be marked
    std::vector<std::uint32_t> suspects_;  // of these, the costliest first
    std::vector<Corner> quads_at_;         // by vertex, then edge, of those that may be marked
};

}  // namespace

std::vector<char> diagonal_marks(const TriangleMesh& solid, int normal_bits, std::uint8_t rule,
                                 unsigned threads) {
    const std::vector<Vector3d> normals = received_normals(solid, normal_bits, threads);
    const Quads quads(solid, normals, threads);
    const double mistakes = rule_costs(solid, quads, true, threads)[rule];
    return diagonal_marks(solid, quads, rule, mistakes, threads);
}

std::vector<char> diagonal_marks(const TriangleMesh& solid, const Quads& quads, std::uint8_t rule,
                                 double mistakes, unsigned threads) {
    const double weight = common::diagonal_weights(rule, true, 0.0).mark;
    const Guesses guesses(solid, quads, rule, threads);
    return Marking(solid.positions.size(), quads, guesses, weight, kLeastShare * mistakes).run();
}

}  // namespace ellicast::sender
