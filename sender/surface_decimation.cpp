// sender/surface_decimation.cpp
#include "sender/surface_decimation.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "sender/edge_table.hpp"
#include "sender/spread_order.hpp"
#include "sender/vertex_queue.hpp"

namespace ellicast::sender {
namespace {

using Eigen::Vector3d;

// Of the squared length of a collapse, times the area that the vertex stands for. It decides on
// planes, where every collapse is free. Ten times as much makes the prefixes worse by a quarter.
constexpr double kLengthWeight = 1e-3;

// Cosine of the most that a triangle may turn. From 0 to 0.5 it makes no difference to the
// prefixes.
constexpr double kLeastCosine = 0.2;

/// Integral of the squared distance to planes as a function of the offset d from a vertex:
/// d'Ad + 2 b'd + c. Kept relative to its vertex, where it is asked, so that floats suffice.
struct Quadric {
    std::array<float, 6> A{};  // xx xy xz yy yz zz
    std::array<float, 3> b{};
    float area = 0;  // sum of the weights

    /// Without c: what it costs to be at d rather than at the vertex itself.
    [[nodiscard]] double rise(const Vector3d& d) const {
        const double x = d[0];
        const double y = d[1];
        const double z = d[2];
        return A[0] * x * x + A[3] * y * y + A[5] * z * z +
               2.0 * (A[1] * x * y + A[2] * x * z + A[4] * y * z + b[0] * x + b[1] * y + b[2] * z);
    }

    void add_plane(const Vector3d& n, double weight) {
        A[0] += static_cast<float>(weight * n[0] * n[0]);
        A[1] += static_cast<float>(weight * n[0] * n[1]);
        A[2] += static_cast<float>(weight * n[0] * n[2]);
        A[3] += static_cast<float>(weight * n[1] * n[1]);
        A[4] += static_cast<float>(weight * n[1] * n[2]);
        A[5] += static_cast<float>(weight * n[2] * n[2]);
        area += static_cast<float>(weight);
    }

    /// Adds `other`, which is kept relative to a vertex that lies at -d.
    void add_moved(const Quadric& other, const Vector3d& d) {
        const auto& Q = other.A;
        b[0] += other.b[0] + static_cast<float>(Q[0] * d[0] + Q[1] * d[1] + Q[2] * d[2]);
        b[1] += other.b[1] + static_cast<float>(Q[1] * d[0] + Q[3] * d[1] + Q[4] * d[2]);
        b[2] += other.b[2] + static_cast<float>(Q[2] * d[0] + Q[4] * d[1] + Q[5] * d[2]);
        for (std::size_t k = 0; k < A.size(); ++k) A[k] += Q[k];
        area += other.area;
    }
};

enum class Allowed { good_shape, same_topology, anything };

class Decimation {
  public:
    explicit Decimation(const common::TriangleMesh& surface)
        : label_(morton_order(surface.positions)), queue_(surface.positions.size()) {
        place_vertices(surface);
        link_triangles(surface);
        add_quadrics();
        marks_.assign(positions_.size(), 0);
        target_.assign(positions_.size(), kNone);
    }

    std::vector<std::uint32_t> run(const std::vector<bool>& keep);
    [[nodiscard]] std::vector<common::Triangle> triangles() const;

  private:
    void place_vertices(const common::TriangleMesh& surface);
    void link_triangles(const common::TriangleMesh& surface);
    void add_quadrics();
    void read_star(std::uint32_t v);
    void read_neighbours(std::uint32_t v);
    void evaluate(std::uint32_t v);
    [[nodiscard]] bool may_collapse(std::uint32_t v, std::uint32_t u);
    [[nodiscard]] bool keeps_topology(std::uint32_t u);
    [[nodiscard]] bool keeps_shape(std::uint32_t v, std::uint32_t u) const;
    void collapse(std::uint32_t v, std::uint32_t u);

    // Half-edge 3 t + c is also the corner c of triangle t. The corners of a vertex are a chain, so
    // that any set of triangles can be told and two vertices become one by joining their chains.
    std::vector<std::uint32_t> label_;  // of a vertex here: its index in the surface
    std::vector<Vector3d> positions_;
    std::vector<common::Triangle> triangles_;  // dead ones begin with kNone
    std::vector<HalfEdge> next_corner_;
    std::vector<HalfEdge> first_corner_;
    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> target_;
    std::vector<std::uint32_t> marks_;
    std::uint32_t mark_ = 0;
    VertexQueue queue_;
    std::vector<bool> keep_;
    Allowed allowed_ = Allowed::good_shape;

    struct Opposite {
        std::uint32_t a, b;
    };
    std::vector<Opposite> star_;
    struct Candidate {
        double cost;
        std::uint32_t vertex;
        bool operator<(const Candidate& other) const {
            return cost != other.cost ? cost < other.cost : vertex < other.vertex;
        }
    };
    std::vector<Candidate> candidates_;
    std::vector<std::uint32_t> ring_;
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
    triangles_.reserve(surface.triangles.size());
    for (const common::Triangle& t : surface.triangles) {
        const common::Triangle here{vertex_of[t[0]], vertex_of[t[1]], vertex_of[t[2]]};
        if (here[0] != here[1] && here[1] != here[2] && here[2] != here[0]) {
            triangles_.push_back(here);
        }
    }
    const Buckets along_curve(triangles_.size(), label_.size(), [&](std::size_t t) {
        return *std::min_element(triangles_[t].begin(), triangles_[t].end());
    });
    std::vector<common::Triangle> sorted;
    sorted.reserve(triangles_.size());
    for (const std::uint32_t t : along_curve.items) sorted.push_back(triangles_[t]);
    triangles_ = std::move(sorted);

    first_corner_.assign(label_.size(), kNone);
    next_corner_.resize(3 * triangles_.size());
    for (std::size_t h = next_corner_.size(); h-- > 0;) {
        const std::uint32_t v = triangles_[h / 3][h % 3];
        next_corner_[h] = first_corner_[v];
        first_corner_[v] = static_cast<HalfEdge>(h);
    }
}

void Decimation::add_quadrics() {
    quadrics_.resize(positions_.size());
    for (const common::Triangle& t : triangles_) {
        const Vector3d n =
            (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);
        const double twice_area = n.norm();
        if (!(twice_area > 0.0)) continue;
        // A third of the triangle for each corner, so that the sum over vertices is the surface.
        for (const std::uint32_t v : t) quadrics_[v].add_plane(n / twice_area, twice_area / 6.0);
    }
}

/// Puts the opposite edges of v's triangles into star_, and drops the dead ones from its chain.
void Decimation::read_star(std::uint32_t v) {
    star_.clear();
    HalfEdge* link = &first_corner_[v];
    while (*link != kNone) {
        const HalfEdge h = *link;
        const common::Triangle& t = triangles_[h / 3];
        if (t[0] == kNone) {
            *link = next_corner_[h];
            continue;
        }
        const std::uint32_t c = h % 3;
        star_.push_back({t[c == 2 ? 0 : c + 1], t[c == 0 ? 2 : c - 1]});
        link = &next_corner_[h];
    }
}

/// Puts the neighbours of v into ring_ and marks them, once each.
void Decimation::read_neighbours(std::uint32_t v) {
    read_star(v);
    ++mark_;
    ring_.clear();
    for (const Opposite& edge : star_) {
        for (const std::uint32_t u : {edge.a, edge.b}) {
            if (marks_[u] == mark_) continue;
            marks_[u] = mark_;
            ring_.push_back(u);
        }
    }
}

void Decimation::evaluate(std::uint32_t v) {
    if (!keep_.empty() && keep_[v]) return;
    read_neighbours(v);
    candidates_.clear();
    const Quadric& Q = quadrics_[v];
    for (const std::uint32_t u : ring_) {
        const Vector3d d = positions_[u] - positions_[v];
        candidates_.push_back({Q.rise(d) + kLengthWeight * Q.area * d.squaredNorm(), u});
    }
    while (!candidates_.empty()) {
        const auto best = std::min_element(candidates_.begin(), candidates_.end());
        if (may_collapse(v, best->vertex)) {
            target_[v] = best->vertex;
            queue_.set(v, best->cost);
            return;
        }
        *best = candidates_.back();
        candidates_.pop_back();
    }
    target_[v] = kNone;
    queue_.remove(v);
}

bool Decimation::may_collapse(std::uint32_t v, std::uint32_t u) {
    if (allowed_ == Allowed::anything) return true;
    if (allowed_ == Allowed::good_shape && !keeps_shape(v, u)) return false;
    return keeps_topology(u);
}

/// The link condition ([DEGN99]) for the vertex whose star was read, neighbours marked.
bool Decimation::keeps_topology(std::uint32_t u) {
    std::size_t at_edge = 0;
    for (const Opposite& edge : star_) at_edge += edge.a == u || edge.b == u ? 1 : 0;
    std::size_t common = 0;
    std::size_t valence = 0;
    for (HalfEdge h = first_corner_[u]; h != kNone; h = next_corner_[h]) {
        const common::Triangle& t = triangles_[h / 3];
        if (t[0] == kNone) continue;
        ++valence;
        if (marks_[t[h % 3 == 2 ? 0 : h % 3 + 1]] == mark_) ++common;
    }
    // A tetrahedron would become two triangles back to back.
    return common == at_edge && !(star_.size() == 3 && valence == 3);
}

bool Decimation::keeps_shape(std::uint32_t v, std::uint32_t u) const {
    const Vector3d& from = positions_[v];
    const Vector3d& to = positions_[u];
    for (const Opposite& edge : star_) {
        if (edge.a == u || edge.b == u) continue;
        const Vector3d& a = positions_[edge.a];
        const Vector3d ab = positions_[edge.b] - a;
        const Vector3d before = ab.cross(from - a);
        const Vector3d after = ab.cross(to - a);
        const double along = before.dot(after);
        if (!(along > 0.0) || along * along < kLeastCosine * kLeastCosine * before.squaredNorm() *
                                                  after.squaredNorm()) {
            return false;
        }
    }
    return true;
}

void Decimation::collapse(std::uint32_t v, std::uint32_t u) {
    HalfEdge* link = &first_corner_[v];
    while (*link != kNone) {
        const HalfEdge h = *link;
        common::Triangle& t = triangles_[h / 3];
        if (t[0] == u || t[1] == u || t[2] == u) t[0] = kNone;
        if (t[0] == kNone) {
            *link = next_corner_[h];
            continue;
        }
        t[h % 3] = u;
        link = &next_corner_[h];
    }
    *link = first_corner_[u];
    first_corner_[u] = first_corner_[v];
    first_corner_[v] = kNone;
    quadrics_[u].add_moved(quadrics_[v], positions_[u] - positions_[v]);
}

std::vector<std::uint32_t> Decimation::run(const std::vector<bool>& keep) {
    if (!keep.empty()) {
        keep_.resize(label_.size());
        for (std::size_t v = 0; v < label_.size(); ++v) keep_[v] = keep[label_[v]];
    }
    std::vector<std::uint32_t> order;
    std::vector<bool> gone(label_.size(), false);
    std::vector<std::uint32_t> touched;
    for (const Allowed allowed : {Allowed::good_shape, Allowed::same_topology, Allowed::anything}) {
        allowed_ = allowed;
        for (std::uint32_t v = 0; v < label_.size(); ++v) {
            if (!gone[v]) evaluate(v);
        }
        while (!queue_.empty()) {
            const std::uint32_t v = queue_.first();
            read_neighbours(v);
            const std::uint32_t u = target_[v];
            if (marks_[u] != mark_ || !may_collapse(v, u)) {
                evaluate(v);
                continue;
            }
            touched = ring_;
            collapse(v, u);
            queue_.remove(v);
            gone[v] = true;
            order.push_back(label_[v]);
            for (const std::uint32_t x : touched) evaluate(x);
        }
    }
    std::vector<std::uint32_t> left;
    for (std::uint32_t v = 0; v < label_.size(); ++v) {
        if (!gone[v]) left.push_back(v);
    }
    std::vector<Eigen::Vector3d> places;
    for (const std::uint32_t v : left) places.push_back(positions_[v]);
    std::vector<std::uint32_t> rest;
    for (const std::uint32_t k : spread_order(places, 1)) rest.push_back(left[k]);
    std::stable_sort(rest.begin(), rest.end(), [&](std::uint32_t a, std::uint32_t b) {
        return quadrics_[a].area > quadrics_[b].area;
    });
    for (std::size_t k = rest.size(); k-- > 0;) order.push_back(label_[rest[k]]);
    return order;
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
    return Decimation(surface).run({});
}

common::TriangleMesh collapsed_onto(const common::TriangleMesh& surface,
                                    const std::vector<bool>& keep) {
    Decimation decimation(surface);
    decimation.run(keep);
    return {surface.positions, decimation.triangles()};
}

}  // namespace ellicast::sender
