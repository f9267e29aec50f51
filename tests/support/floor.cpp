// tests/support/floor.cpp: see floor.hpp. Triangles by index with a list of them per vertex: small,
// and easy to trust.
#include "tests/support/floor.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

namespace ellicast::tests {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;
using Index = std::uint32_t;

// Sum of squared distances to planes, by area: x'Ax + 2b'x + c.
struct Quadric {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    double c = 0;

    void add_plane(const Vector3d& n, double d, double weight) {
        A += weight * n * n.transpose();
        b += weight * d * n;
        c += weight * d * d;
    }
    void add(const Quadric& other) {
        A += other.A;
        b += other.b;
        c += other.c;
    }
    [[nodiscard]] double at(const Vector3d& x) const { return x.dot(A * x + 2 * b) + c; }
};

// How strict a collapse has to be; tried one after the other, each until it finds nothing more.
enum class Rule {
    onto_survivors,  // no triangle turns by more than kLeastCosine
    onto_anyone,     // the same
    unturned,        // by less than a right angle
    turned           // anything that keeps the topology
};
constexpr std::array kRules{Rule::onto_survivors, Rule::onto_anyone, Rule::unturned, Rule::turned};
constexpr double kLeastCosine = 0.2;  // 0.5 or -0.5 instead: the same within 3 %

class Decimation {
  public:
    Decimation(const TriangleMesh& original, std::vector<bool> lost);
    void run(std::size_t stop_at);
    Collapsed result();

  private:
    struct Candidate {
        double cost;
        Index vertex;
        Index onto;
        std::uint32_t version;
        bool operator>(const Candidate& o) const {
            return std::tie(cost, vertex, onto) > std::tie(o.cost, o.vertex, o.onto);
        }
    };

    [[nodiscard]] const Vector3d& at(Index v) const { return mesh_.positions[v]; }
    [[nodiscard]] bool going(Index v) const { return lost_[v] && !gone_[v]; }
    void collect_ring(Index v, std::vector<Index>& ring);
    bool link_allows(Index v, Index onto);
    [[nodiscard]] bool shape_allows(Index v, Index onto) const;
    [[nodiscard]] double cost(Index v, Index onto) const;
    void offer(Index v);
    void offer_all();
    void pass();
    void collapse(Index v, Index onto);
    bool free_by_flips(Index v);
    bool flip(Index v, Index w);

    TriangleMesh mesh_;
    std::vector<bool> lost_;
    std::vector<bool> gone_;
    std::vector<std::vector<Index>> around_;  // triangles of a vertex
    std::vector<bool> dead_;                  // triangles
    std::vector<Quadric> quadric_;
    std::vector<std::uint32_t> version_;
    std::vector<std::uint32_t> mark_;  // of link_allows
    std::uint32_t stamp_ = 0;
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> heap_;
    std::vector<Index> ring_, other_ring_;
    Rule rule_ = Rule::onto_survivors;
    bool everything_;       // is lost: a decimation
    std::size_t left_ = 0;  // vertices still there
    std::size_t stop_at_ = 0;
    Collapsed result_;
};

bool has(const Triangle& triangle, Index v) {
    return triangle[0] == v || triangle[1] == v || triangle[2] == v;
}

void replace(Triangle& triangle, Index from, Index to) {
    std::replace(triangle.begin(), triangle.end(), from, to);
}

Decimation::Decimation(const TriangleMesh& original, std::vector<bool> lost)
    : mesh_(original),
      lost_(std::move(lost)),
      gone_(original.positions.size(), false),
      around_(original.positions.size()),
      dead_(original.triangles.size(), false),
      quadric_(original.positions.size()),
      version_(original.positions.size(), 0),
      mark_(original.positions.size(), 0),
      everything_(std::find(lost_.begin(), lost_.end(), false) == lost_.end()),
      left_(original.positions.size()) {
    for (Index t = 0; t < mesh_.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh_.triangles[t];
        const Vector3d normal = (at(b) - at(a)).cross(at(c) - at(a));
        const double twice_area = normal.norm();
        for (const Index v : {a, b, c}) {
            around_[v].push_back(t);
            if (!(twice_area > 0)) continue;
            const Vector3d n = normal / twice_area;
            quadric_[v].add_plane(n, -n.dot(at(a)), twice_area);
        }
    }
}

void Decimation::collect_ring(Index v, std::vector<Index>& ring) {
    ring.clear();
    for (const Index t : around_[v]) {
        for (const Index w : mesh_.triangles[t]) {
            if (w != v) ring.push_back(w);
        }
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
}

// The link condition of an edge inside a manifold: two triangles at it, and no other common
// neighbour than their tips. Both rings closed, and more than a tetrahedron's triangles.
bool Decimation::link_allows(Index v, Index onto) {
    collect_ring(v, ring_);
    collect_ring(onto, other_ring_);
    if (ring_.size() != around_[v].size()) return false;  // at a boundary, or no disc
    ++stamp_;
    for (const Index w : ring_) mark_[w] = stamp_;
    std::size_t common = 0;
    for (const Index w : other_ring_) common += mark_[w] == stamp_;
    std::size_t shared = 0;
    for (const Index t : around_[v]) shared += has(mesh_.triangles[t], onto);
    if (common != 2 || shared != 2) return false;
    return around_[v].size() > 3 || other_ring_.size() > 3;
}

bool Decimation::shape_allows(Index v, Index onto) const {
    if (rule_ == Rule::turned) return true;
    const double least = rule_ == Rule::unturned ? 0.0 : kLeastCosine;
    for (const Index t : around_[v]) {
        if (has(mesh_.triangles[t], onto)) continue;
        const auto& [a, b, c] = mesh_.triangles[t];
        const Vector3d before = (at(b) - at(a)).cross(at(c) - at(a));
        Triangle moved = mesh_.triangles[t];
        replace(moved, v, onto);
        const Vector3d after = (at(moved[1]) - at(moved[0])).cross(at(moved[2]) - at(moved[0]));
        if (!(before.dot(after) > least * before.norm() * after.norm())) return false;
    }
    return true;
}

double Decimation::cost(Index v, Index onto) const {
    const double own = quadric_[v].at(at(onto));
    return everything_ ? own + quadric_[onto].at(at(onto)) : own;
}

// Puts the vertex's cheapest legal collapse into the heap; older offers lapse.
void Decimation::offer(Index v) {
    ++version_[v];
    std::vector<Index> neighbours;
    collect_ring(v, neighbours);
    std::vector<std::pair<double, Index>> choices;
    choices.reserve(neighbours.size());
    for (const Index w : neighbours) {
        if (rule_ == Rule::onto_survivors && lost_[w]) continue;
        choices.emplace_back(cost(v, w), w);
    }
    std::sort(choices.begin(), choices.end());
    for (const auto& [price, w] : choices) {
        if (!shape_allows(v, w) || !link_allows(v, w)) continue;
        heap_.push({price, v, w, version_[v]});
        return;
    }
}

void Decimation::offer_all() {
    for (Index v = 0; v < gone_.size(); ++v) {
        if (going(v)) offer(v);
    }
}

void Decimation::collapse(Index v, Index onto) {
    std::vector<Index> ring;
    collect_ring(v, ring);
    for (const Index t : around_[v]) {
        if (has(mesh_.triangles[t], onto)) {
            dead_[t] = true;
            for (const Index w : mesh_.triangles[t]) {
                if (w != v) std::erase(around_[w], t);
            }
        } else {
            replace(mesh_.triangles[t], v, onto);
            around_[onto].push_back(t);
        }
    }
    around_[v].clear();
    gone_[v] = true;
    --left_;
    quadric_[onto].add(quadric_[v]);
    result_.removed.push_back(v);
    result_.forced += rule_ == Rule::turned;
    for (const Index w : ring) {
        if (going(w)) offer(w);
    }
    // What lies around `onto` pays its grown quadric.
    collect_ring(onto, ring);
    for (const Index w : ring) {
        if (going(w)) offer(w);
    }
}

void Decimation::pass() {
    while (!heap_.empty() && left_ > stop_at_) {
        const Candidate best = heap_.top();
        heap_.pop();
        if (!going(best.vertex) || version_[best.vertex] != best.version) continue;
        // What lies two rings away may have changed since.
        if (shape_allows(best.vertex, best.onto) && link_allows(best.vertex, best.onto)) {
            collapse(best.vertex, best.onto);
        } else {
            offer(best.vertex);
        }
    }
}

// Turns the edge between v and w, so that both lose it.
bool Decimation::flip(Index v, Index w) {
    std::array<Index, 2> pair{};
    std::size_t found = 0;
    for (const Index t : around_[v]) {
        if (!has(mesh_.triangles[t], w)) continue;
        if (found == 2) return false;
        pair[found++] = t;
    }
    if (found != 2 || around_[w].size() <= 3) return false;
    const auto tip = [&](Index t) {
        for (const Index x : mesh_.triangles[t]) {
            if (x != v && x != w) return x;
        }
        return v;
    };
    const Index a = tip(pair[0]);
    const Index b = tip(pair[1]);
    collect_ring(a, ring_);
    if (a == b || std::binary_search(ring_.begin(), ring_.end(), b)) return false;
    replace(mesh_.triangles[pair[0]], w, b);
    replace(mesh_.triangles[pair[1]], v, a);
    std::erase(around_[w], pair[0]);
    std::erase(around_[v], pair[1]);
    around_[b].push_back(pair[0]);
    around_[a].push_back(pair[1]);
    return true;
}

// Flips edges away from v until the link condition allows a collapse.
bool Decimation::free_by_flips(Index v) {
    bool any = false;
    while (around_[v].size() > 3) {
        std::vector<Index> ring;
        collect_ring(v, ring);
        bool flipped = false;
        for (const Index w : ring) {
            if (flip(v, w)) {
                flipped = true;
                break;
            }
        }
        if (!flipped) break;
        any = true;
        offer(v);
        if (!heap_.empty() && heap_.top().vertex == v) break;
    }
    return any;
}

void Decimation::run(std::size_t stop_at) {
    stop_at_ = stop_at;
    for (Index v = 0; v < gone_.size() && left_ > stop_at_; ++v) {
        if (!going(v) || !around_[v].empty()) continue;
        gone_[v] = true;
        result_.removed.push_back(v);
        --left_;
    }
    for (const Rule rule : kRules) {
        rule_ = rule;
        std::size_t before = left_ + 1;
        while (left_ < before && left_ > stop_at_) {
            before = left_;
            offer_all();
            pass();
        }
    }
    for (Index v = 0; v < gone_.size() && left_ > stop_at_; ++v) {
        if (going(v) && free_by_flips(v)) pass();
    }
}

Collapsed Decimation::result() {
    std::vector<Triangle> alive;
    for (Index t = 0; t < mesh_.triangles.size(); ++t) {
        if (!dead_[t]) alive.push_back(mesh_.triangles[t]);
    }
    mesh_.triangles = std::move(alive);
    result_.mesh = std::move(mesh_);
    for (Index v = 0; v < gone_.size(); ++v) result_.remaining += going(v);
    return std::move(result_);
}

}  // namespace

Collapsed collapse_lost(const TriangleMesh& original, const std::vector<bool>& kept) {
    assert(kept.size() == original.positions.size());
    std::vector<bool> lost = kept;
    lost.flip();
    Decimation decimation(original, std::move(lost));
    decimation.run(0);
    return decimation.result();
}

TriangleMesh collapse_onto(const TriangleMesh& original, const std::vector<bool>& kept) {
    return collapse_lost(original, kept).mesh;
}

Collapsed decimate(const TriangleMesh& original, std::size_t vertices) {
    Decimation decimation(original, std::vector<bool>(original.positions.size(), true));
    decimation.run(vertices);
    return decimation.result();
}

}  // namespace ellicast::tests
