// sender/surface_decimation.cpp
#include "sender/surface_decimation.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "sender/collapse_cost.hpp"
#include "sender/edge_table.hpp"
#include "sender/spread_order.hpp"
#include "sender/vertex_queue.hpp"

namespace ellicast::sender {
namespace {

using Eigen::Vector3d;

// Of the squared length of a collapse, times the area that the vertex stands for. It decides on
// planes, where every collapse is free, and keeps the vertices of a prefix from lining up along
// creases: with less the collapsed original is nearer (a third of this: 4 %), but what a receiver
// without connectivity makes of the prefix is not. Ten times as much: worse by a quarter.
constexpr double kLengthWeight = 1e-3;

// Cosine of the most that a triangle may turn. From 0 to 0.5 it makes no difference to the
// prefixes.
constexpr double kLeastCosine = 0.2;

// Removed vertices that stand for all of them around one vertex. Without a limit the last collapses
// would measure the whole model.
constexpr std::size_t kMostWitnesses = 32;

/// What a collapse may do.
enum class Allowed { good_shape, same_topology, anything };

class Decimation {
  public:
    explicit Decimation(const common::TriangleMesh& surface)
        : label_(morton_order(surface.positions)),
          target_(label_.size(), kNone),
          changed_(label_.size(), false),
          removed_(label_.size(), false),
          marks_(label_.size(), 0),
          queue_(label_.size()) {
        place_vertices(surface);
        link_triangles(surface);
        add_quadrics();
        witness_of_.assign(triangles_.size(), kNone);
        next_witness_.assign(label_.size(), kNone);
        squared_distance_.assign(label_.size(), 0.0f);
    }

    /// Everything; gives the order in which it went. Once.
    std::vector<std::uint32_t> remove_all();
    /// What is not to be kept, as far as that leaves the topology alone. Once.
    void remove_all_but(const std::vector<bool>& keep);
    /// What is left.
    [[nodiscard]] std::vector<common::Triangle> triangles() const;

  private:
    void place_vertices(const common::TriangleMesh& surface);
    void link_triangles(const common::TriangleMesh& surface);
    void add_quadrics();
    void read_star(std::uint32_t v);
    void read_witnesses(std::uint32_t v);
    void evaluate(std::uint32_t v);
    [[nodiscard]] bool may_collapse(std::uint32_t v, std::uint32_t u) const;
    [[nodiscard]] bool keeps_topology(std::uint32_t u) const;
    [[nodiscard]] bool keeps_shape(std::uint32_t v, std::uint32_t u) const;
    [[nodiscard]] double plane_cost(std::uint32_t v, std::uint32_t u) const;
    [[nodiscard]] double true_cost(std::uint32_t v, std::uint32_t u);
    void remove_allowed(Allowed allowed);
    void collapse_first();
    void collapse(std::uint32_t v, std::uint32_t u);
    void move_witnesses(std::uint32_t v, std::uint32_t u);
    void remove_isolated();

    // Vertices are named along a Morton curve, so that neighbours are near in memory. Half-edge
    // 3 t + c is also the corner c of triangle t. The corners of a vertex are a chain: so any set
    // of triangles can be told, and two vertices become one by joining their chains.
    std::vector<std::uint32_t> label_;  // a vertex' index in the surface
    std::vector<Vector3d> positions_;
    std::vector<common::Triangle> triangles_;  // a dead one begins with kNone
    std::vector<HalfEdge> first_corner_;
    std::vector<HalfEdge> next_corner_;

    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> target_;  // where a vertex in the queue would go
    std::vector<bool> changed_;          // its neighbourhood, since its cost was computed
    std::vector<bool> removed_;
    std::vector<bool> keep_;  // or empty
    std::vector<std::uint32_t> order_;

    // Removed vertices bear witness of the surface that was: each is kept with the triangle next to
    // it.
    std::vector<std::uint32_t> witness_of_;    // the first of a triangle
    std::vector<std::uint32_t> next_witness_;  // of the same triangle
    std::vector<float> squared_distance_;      // from that triangle
    std::vector<float> witnessed_;             // area

    Allowed allowed_ = Allowed::good_shape;
    std::vector<std::uint32_t> marks_;  // a vertex has the current mark: it is in ring_
    std::uint32_t mark_ = 0;
    VertexQueue queue_;

    // Of the vertex that was looked at last.
    struct Blade {
        std::uint32_t a, b;  // what the triangle has beside the vertex
        std::uint32_t triangle;
    };
    std::vector<Blade> star_;
    std::vector<std::uint32_t> ring_;
    std::vector<std::uint32_t> touched_;  // the ring of the vertex that was removed last
    std::vector<std::uint32_t> witnesses_;
    std::vector<std::pair<double, std::uint32_t>> candidates_;
    TriangleFan fan_;
};

void Decimation::place_vertices(const common::TriangleMesh& surface) {
    const Eigen::AlignedBox3d box = common::bounding_box(surface.positions);
    const double size = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
    const double scale = size > 0.0 && std::isfinite(size) ? 1.0 / size : 0.0;
    positions_.reserve(label_.size());
    for (const std::uint32_t index : label_) {
        positions_.push_back((surface.positions[index] - box.min()) * scale);
    }
}

void Decimation::link_triangles(const common::TriangleMesh& surface) {
    std::vector<std::uint32_t> vertex_of(label_.size());
    for (std::uint32_t v = 0; v < label_.size(); ++v) vertex_of[label_[v]] = v;
    std::vector<common::Triangle> renamed;
    renamed.reserve(surface.triangles.size());
    for (const common::Triangle& t : surface.triangles) {
        const common::Triangle here{vertex_of[t[0]], vertex_of[t[1]], vertex_of[t[2]]};
        if (here[0] != here[1] && here[1] != here[2] && here[2] != here[0]) {
            renamed.push_back(here);
        }
    }
    const Buckets along_curve(renamed.size(), label_.size(), [&](std::size_t t) {
        return *std::min_element(renamed[t].begin(), renamed[t].end());
    });
    triangles_.reserve(renamed.size());
    for (const std::uint32_t t : along_curve.items) triangles_.push_back(renamed[t]);

    first_corner_.assign(label_.size(), kNone);
    next_corner_.resize(3 * triangles_.size());
    for (std::size_t h = next_corner_.size(); h-- > 0;) {
        const std::uint32_t v = origin(triangles_, static_cast<HalfEdge>(h));
        next_corner_[h] = first_corner_[v];
        first_corner_[v] = static_cast<HalfEdge>(h);
    }
}

void Decimation::add_quadrics() {
    quadrics_.resize(label_.size());
    for (const common::Triangle& t : triangles_) {
        const Vector3d& a = positions_[t[0]];
        const Vector3d n = (positions_[t[1]] - a).cross(positions_[t[2]] - a);
        const double twice_area = n.norm();
        if (!(twice_area > 0.0)) continue;
        // A third of the triangle for each corner, so that the sum over the vertices is the
        // surface.
        for (const std::uint32_t v : t) quadrics_[v].add_plane(n / twice_area, twice_area / 6.0);
    }
    witnessed_.reserve(label_.size());
    for (const Quadric& Q : quadrics_) witnessed_.push_back(Q.area);
}

/// Fills star_ and ring_ and marks the ring; takes dead triangles out of the chain.
void Decimation::read_star(std::uint32_t v) {
    ++mark_;
    star_.clear();
    ring_.clear();
    HalfEdge* link = &first_corner_[v];
    while (*link != kNone) {
        const HalfEdge h = *link;
        const common::Triangle& t = triangles_[triangle_of(h)];
        if (t[0] == kNone) {
            *link = next_corner_[h];
            continue;
        }
        const HalfEdge next = next_in_triangle(h);
        const Blade blade{origin(triangles_, next), target(triangles_, next), triangle_of(h)};
        star_.push_back(blade);
        for (const std::uint32_t u : {blade.a, blade.b}) {
            if (marks_[u] == mark_) continue;
            marks_[u] = mark_;
            ring_.push_back(u);
        }
        link = &next_corner_[h];
    }
}

/// Of the star that was read: the removed vertices there, and first v itself.
void Decimation::read_witnesses(std::uint32_t v) {
    witnesses_.assign(1, v);
    for (const Blade& blade : star_) {
        for (std::uint32_t w = witness_of_[blade.triangle]; w != kNone; w = next_witness_[w]) {
            witnesses_.push_back(w);
        }
    }
}

/// How much farther from their planes u is than v, and the length of the way.
double Decimation::plane_cost(std::uint32_t v, std::uint32_t u) const {
    const Vector3d d = positions_[u] - positions_[v];
    return quadrics_[v].at(d) + kLengthWeight * quadrics_[v].area * d.squaredNorm();
}

/// How much farther from the surface the witnesses are afterwards. Planes know nothing of the
/// triangles: with this the prefixes are 5 to 20 % better, for as much time again.
double Decimation::true_cost(std::uint32_t v, std::uint32_t u) {
    fan_.clear(positions_[u]);
    for (const Blade& blade : star_) {
        if (blade.a == u || blade.b == u) continue;
        fan_.add(positions_[blade.a], positions_[blade.b], blade.triangle);
    }
    if (fan_.empty()) return 0.0;
    read_witnesses(v);
    double sum = 0.0;
    for (const std::uint32_t w : witnesses_) {
        sum +=
            witnessed_[w] * (fan_.nearest(positions_[w]).squared_distance - squared_distance_[w]);
    }
    return std::max(0.0, sum);
}

/// Puts v into the queue with the allowed collapse that is cheapest by planes, or takes it out.
void Decimation::evaluate(std::uint32_t v) {
    if (!keep_.empty() && keep_[v]) return;
    changed_[v] = false;
    read_star(v);
    candidates_.clear();
    for (const std::uint32_t u : ring_) candidates_.emplace_back(plane_cost(v, u), u);
    while (!candidates_.empty()) {
        const auto best = std::min_element(candidates_.begin(), candidates_.end());
        const auto [cost, u] = *best;
        if (may_collapse(v, u)) {
            target_[v] = u;
            queue_.set(v, cost + true_cost(v, u));
            return;
        }
        *best = candidates_.back();
        candidates_.pop_back();
    }
    target_[v] = kNone;
    queue_.remove(v);
}

/// For the vertex v whose star was read, and a neighbour u.
bool Decimation::may_collapse(std::uint32_t v, std::uint32_t u) const {
    if (allowed_ == Allowed::anything) return true;
    return (allowed_ == Allowed::same_topology || keeps_shape(v, u)) && keeps_topology(u);
}

/// The link condition ([DEGN99]): no vertex is next to both but those of their common triangles.
bool Decimation::keeps_topology(std::uint32_t u) const {
    const auto at_edge = std::count_if(star_.begin(), star_.end(), [u](const Blade& blade) {
        return blade.a == u || blade.b == u;
    });
    std::ptrdiff_t common = 0;
    std::size_t valence = 0;
    for (HalfEdge h = first_corner_[u]; h != kNone; h = next_corner_[h]) {
        if (triangles_[triangle_of(h)][0] == kNone) continue;
        ++valence;
        if (marks_[target(triangles_, h)] == mark_) ++common;
    }
    // A tetrahedron would become two triangles back to back.
    return common == at_edge && !(star_.size() == 3 && valence == 3);
}

/// No triangle turns by much.
bool Decimation::keeps_shape(std::uint32_t v, std::uint32_t u) const {
    for (const Blade& blade : star_) {
        if (blade.a == u || blade.b == u) continue;
        const Vector3d& a = positions_[blade.a];
        const Vector3d ab = positions_[blade.b] - a;
        const Vector3d before = ab.cross(positions_[v] - a);
        const Vector3d after = ab.cross(positions_[u] - a);
        const double along = before.dot(after);
        const double bound =
            kLeastCosine * kLeastCosine * before.squaredNorm() * after.squaredNorm();
        if (!(along > 0.0 && along * along >= bound)) return false;
    }
    return true;
}

/// Hands the witnesses around v to the triangles that there will be. Where they are too many, every
/// second one hands its area to the one before it and goes. Requires v's star read.
void Decimation::move_witnesses(std::uint32_t v, std::uint32_t u) {
    read_witnesses(v);
    fan_.clear(positions_[u]);
    for (const Blade& blade : star_) {
        witness_of_[blade.triangle] = kNone;
        if (blade.a == u || blade.b == u) continue;
        fan_.add(positions_[blade.a], positions_[blade.b], blade.triangle);
    }
    if (fan_.empty()) return;
    const std::size_t step = witnesses_.size() > kMostWitnesses ? 2 : 1;
    for (std::size_t k = 0; k < witnesses_.size(); k += step) {
        const std::uint32_t w = witnesses_[k];
        if (step == 2 && k + 1 < witnesses_.size()) witnessed_[w] += witnessed_[witnesses_[k + 1]];
        const TriangleFan::Nearest nearest = fan_.nearest(positions_[w]);
        squared_distance_[w] = static_cast<float>(nearest.squared_distance);
        next_witness_[w] = witness_of_[nearest.name];
        witness_of_[nearest.name] = w;
    }
}

/// Requires v's star read.
void Decimation::collapse(std::uint32_t v, std::uint32_t u) {
    move_witnesses(v, u);
    HalfEdge* link = &first_corner_[v];
    while (*link != kNone) {
        const HalfEdge h = *link;
        common::Triangle& t = triangles_[triangle_of(h)];
        if (t[0] == u || t[1] == u || t[2] == u) {
            t[0] = kNone;
            *link = next_corner_[h];
        } else {
            t[h % 3] = u;
            link = &next_corner_[h];
        }
    }
    *link = first_corner_[u];
    first_corner_[u] = first_corner_[v];
    first_corner_[v] = kNone;
    quadrics_[u].add_moved(quadrics_[v], positions_[u] - positions_[v]);
}

/// The first of the queue, unless its cost is out of date. Neighbours are not computed anew, which
/// is dear, until they come first; only the one that stands for more now, and those that might be
/// free to go.
void Decimation::collapse_first() {
    const std::uint32_t v = queue_.first();
    const std::uint32_t u = target_[v];
    if (changed_[v]) return evaluate(v);
    read_star(v);
    if (marks_[u] != mark_ || !may_collapse(v, u)) return evaluate(v);
    collapse(v, u);
    queue_.remove(v);
    removed_[v] = true;
    order_.push_back(label_[v]);
    touched_.swap(ring_);
    for (const std::uint32_t x : touched_) {
        if (x == u || target_[x] == kNone) {
            evaluate(x);
        } else {
            changed_[x] = true;
        }
    }
}

/// Who has no triangle any more, or never had one: who stands for the least area first, and among
/// equals backwards through a spread order.
void Decimation::remove_isolated() {
    std::vector<std::uint32_t> left;
    std::vector<Vector3d> places;
    for (std::uint32_t v = 0; v < label_.size(); ++v) {
        if (removed_[v]) continue;
        left.push_back(v);
        places.push_back(positions_[v]);
    }
    std::vector<std::uint32_t> spread = spread_order(places, 1);
    std::reverse(spread.begin(), spread.end());
    std::stable_sort(spread.begin(), spread.end(), [&](std::uint32_t a, std::uint32_t b) {
        return quadrics_[left[a]].area < quadrics_[left[b]].area;
    });
    for (const std::uint32_t k : spread) order_.push_back(label_[left[k]]);
}

std::vector<std::uint32_t> Decimation::remove_all() {
    order_.reserve(label_.size());
    for (const Allowed allowed : {Allowed::good_shape, Allowed::same_topology, Allowed::anything}) {
        remove_allowed(allowed);
    }
    remove_isolated();
    return std::move(order_);
}

void Decimation::remove_all_but(const std::vector<bool>& keep) {
    keep_.reserve(label_.size());
    for (const std::uint32_t index : label_) keep_.push_back(keep[index]);
    remove_allowed(Allowed::good_shape);
    remove_allowed(Allowed::same_topology);
}

void Decimation::remove_allowed(Allowed allowed) {
    allowed_ = allowed;
    for (std::uint32_t v = 0; v < label_.size(); ++v) {
        if (!removed_[v]) evaluate(v);
    }
    while (!queue_.empty()) collapse_first();
}

std::vector<common::Triangle> Decimation::triangles() const {
    std::vector<common::Triangle> alive;
    for (const common::Triangle& t : triangles_) {
        if (t[0] != kNone) alive.push_back({label_[t[0]], label_[t[1]], label_[t[2]]});
    }
    return alive;
}

}  // namespace

std::vector<std::uint32_t> removal_order(const common::TriangleMesh& surface) {
    return Decimation(surface).remove_all();
}

common::TriangleMesh collapsed_onto(const common::TriangleMesh& surface,
                                    const std::vector<bool>& keep) {
    assert(keep.size() == surface.positions.size());
    Decimation decimation(surface);
    decimation.remove_all_but(keep);
    return {surface.positions, decimation.triangles()};
}

}  // namespace ellicast::sender
