// receiver/vertex_removal.cpp
#include "receiver/vertex_removal.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "receiver/edge_flips.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

// What a collapse may leave behind, from gentle to anything legal.
struct Bounds {
    double min_quality;  // triangle_quality of every changed triangle, or no worse than it was
    double min_cosine;   // between each changed triangle's normal before and after
};
constexpr std::array<Bounds, 5> kPasses = {
    {{0.3, 0.8}, {0.1, 0.6}, {0.02, 0.3}, {1e-3, 0.0}, {-1.0, -2.0}}};

class Remover {
  public:
    explicit Remover(SurfaceMesh& mesh) : mesh_(mesh) {}

    bool remove(VertexId v, const Bounds& bounds) {
        HalfedgeId best = kNone;
        double best_quality = -std::numeric_limits<double>::infinity();
        double worst_now = std::numeric_limits<double>::infinity();
        mesh_.for_each_outgoing(v,
                                [&](HalfedgeId h) { worst_now = std::min(worst_now, quality(h)); });
        const double limit = std::min(bounds.min_quality, worst_now);
        mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
            const double q = quality_after(h, bounds.min_cosine);
            if (q > best_quality && q >= limit && mesh_.can_collapse(h)) {
                best = h;
                best_quality = q;
            }
        });
        if (best == kNone) return false;
        ring_.clear();
        mesh_.for_each_outgoing(v, [&](HalfedgeId h) { ring_.push_back(mesh_.to_vertex(h)); });
        mesh_.collapse(best);
        queue_.clear();
        for (const VertexId u : ring_) {
            mesh_.for_each_outgoing(u, [&](HalfedgeId h) { queue_.push_back(h); });
        }
        flip_to_delaunay(mesh_, queue_);
        return true;
    }

  private:
    [[nodiscard]] double quality(HalfedgeId h) const {
        return triangle_quality(mesh_.position(mesh_.from_vertex(h)),
                                mesh_.position(mesh_.to_vertex(h)),
                                mesh_.position(mesh_.opposite(h)));
    }

    // Worst quality among the triangles that collapsing h changes; minus infinity when one turns
    // too far.
    [[nodiscard]] double quality_after(HalfedgeId collapse, double min_cosine) const {
        const VertexId target = mesh_.to_vertex(collapse);
        const Vector3d& p = mesh_.position(target);
        double worst = std::numeric_limits<double>::infinity();
        mesh_.for_each_outgoing(mesh_.from_vertex(collapse), [&](HalfedgeId h) {
            const VertexId b = mesh_.to_vertex(h);
            const VertexId c = mesh_.opposite(h);
            if (b == target || c == target) return;
            const Vector3d& pb = mesh_.position(b);
            const Vector3d& pc = mesh_.position(c);
            const Vector3d before = mesh_.area_normal(SurfaceMesh::face_of(h));
            const Vector3d after = (pb - p).cross(pc - p);
            if (after.dot(before) < min_cosine * after.norm() * before.norm()) {
                worst = -std::numeric_limits<double>::infinity();
            } else {
                worst = std::min(worst, triangle_quality(p, pb, pc));
            }
        });
        return worst;
    }

    SurfaceMesh& mesh_;
    std::vector<VertexId> ring_;
    std::vector<HalfedgeId> queue_;
};

}  // namespace

std::size_t remove_vertices(SurfaceMesh& mesh, const std::function<bool(VertexId)>& removable) {
    std::vector<VertexId> left;
    for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
        if (mesh.vertex_alive(v) && removable(v)) left.push_back(v);
    }
    Remover remover(mesh);
    for (const Bounds& bounds : kPasses) {
        // Flips and collapses of one pass open ways for others: repeat while it helps.
        for (bool progress = true; progress && !left.empty();) {
            const std::size_t before = left.size();
            std::erase_if(left, [&](VertexId v) { return remover.remove(v, bounds); });
            progress = left.size() < before;
        }
    }
    return left.size();
}

}  // namespace ellicast::receiver
