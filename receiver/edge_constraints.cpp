// receiver/edge_constraints.cpp
#include "receiver/edge_constraints.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <deque>

namespace ellicast::receiver {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// An edge of the original that so many of ours cross is none that flips should bring back.
constexpr std::size_t kMostCrossings = 64;

std::uint64_t key_of(VertexId a, VertexId b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

struct Edge {
    VertexId from, to;
};

// kNone when they are no neighbours.
HalfedgeId halfedge_between(const SurfaceMesh& mesh, VertexId from, VertexId to) {
    HalfedgeId found = kNone;
    mesh.for_each_outgoing(from, [&](HalfedgeId h) {
        if (mesh.to_vertex(h) == to) found = h;
    });
    return found;
}

Vector3d normal_around(const SurfaceMesh& mesh, VertexId v) {
    Vector3d sum = Vector3d::Zero();
    mesh.for_each_outgoing(v,
                           [&](HalfedgeId h) { sum += mesh.area_normal(SurfaceMesh::face_of(h)); });
    return sum;
}

// The plane across the normals at the two ends, with a at its origin and b on its first axis.
class Insertion {
  public:
    Insertion(SurfaceMesh& mesh, VertexId a, VertexId b, const FixedEdges& fixed)
        : mesh_(mesh), fixed_(fixed), a_(a), b_(b) {
        const Vector3d up = normal_around(mesh, a) + normal_around(mesh, b);
        const Vector3d along = mesh.position(b) - mesh.position(a);
        across_ = up.cross(along).normalized();
        along_ = across_.cross(up).normalized();
    }

    bool run() { return find_crossings() && flip_crossings(); }

  private:
    [[nodiscard]] Vector2d plane(VertexId v) const {
        const Vector3d x = mesh_.position(v) - mesh_.position(a_);
        return {x.dot(along_), x.dot(across_)};
    }
    // Positive when p, q, r turn left.
    [[nodiscard]] double turn(VertexId p, VertexId q, VertexId r) const {
        const Vector2d u = plane(q) - plane(p);
        const Vector2d w = plane(r) - plane(p);
        return u.x() * w.y() - u.y() * w.x();
    }
    [[nodiscard]] double side(VertexId v) const { return turn(a_, b_, v); }

    // The half-edge opposite a_ through which the line leaves its first triangle.
    [[nodiscard]] HalfedgeId way_out() const {
        HalfedgeId found = kNone;
        mesh_.for_each_outgoing(a_, [&](HalfedgeId h) {
            const VertexId right = mesh_.to_vertex(h);
            const VertexId left = mesh_.opposite(h);
            if (side(right) < 0.0 && side(left) > 0.0 && turn(a_, right, left) > 0.0) {
                found = SurfaceMesh::next(h);
            }
        });
        return found;
    }

    bool find_crossings() {
        HalfedgeId h = way_out();  // from the right of the line to its left
        if (h == kNone) return false;
        for (;;) {
            if (crossing_.size() == kMostCrossings) return false;
            const Edge edge{mesh_.from_vertex(h), mesh_.to_vertex(h)};
            if (fixed_.contains(edge.from, edge.to)) return false;
            crossing_.push_back(edge);
            const HalfedgeId t = mesh_.twin(h);
            const VertexId apex = mesh_.opposite(t);
            if (apex == b_) return true;
            const double s = side(apex);
            if (s == 0.0 || apex == a_) return false;
            h = s > 0.0 ? SurfaceMesh::next(t) : SurfaceMesh::prev(t);
        }
    }

    [[nodiscard]] bool crosses(VertexId p, VertexId q) const {
        if (p == a_ || p == b_ || q == a_ || q == b_) return false;
        return (side(p) < 0.0) != (side(q) < 0.0);
    }

    bool flip_crossings() {
        std::size_t in_vain = 0;
        while (!crossing_.empty() && in_vain <= crossing_.size()) {
            const Edge edge = crossing_.front();
            crossing_.pop_front();
            const HalfedgeId h = halfedge_between(mesh_, edge.from, edge.to);
            assert(h != kNone);
            const VertexId c = mesh_.opposite(h);
            const VertexId d = mesh_.opposite(mesh_.twin(h));
            const bool convex = turn(c, d, edge.from) * turn(c, d, edge.to) < 0.0;
            if (!convex || !mesh_.can_flip(h)) {
                crossing_.push_back(edge);
                ++in_vain;
                continue;
            }
            mesh_.flip(h);
            if (crosses(c, d)) {
                crossing_.push_back({c, d});
                ++in_vain;
            } else {
                in_vain = 0;
            }
        }
        return crossing_.empty();
    }

    SurfaceMesh& mesh_;
    const FixedEdges& fixed_;
    VertexId a_, b_;
    Vector3d along_, across_;
    std::deque<Edge> crossing_;
};

}  // namespace

void FixedEdges::add(VertexId a, VertexId b) {
    edges_.insert(key_of(a, b));
    ends_[a] = ends_[b] = 1;
}

bool FixedEdges::contains(VertexId a, VertexId b) const {
    if (edges_.empty() || ends_[a] == 0 || ends_[b] == 0) return false;
    return edges_.contains(key_of(a, b));
}

bool insert_edge(SurfaceMesh& mesh, VertexId a, VertexId b, const FixedEdges& fixed) {
    if (mesh.adjacent(a, b)) return true;
    return Insertion(mesh, a, b, fixed).run();
}

}  // namespace ellicast::receiver
