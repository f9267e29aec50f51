// receiver/vertex_removal.cpp
#include "receiver/vertex_removal.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "receiver/edge_flips.hpp"
#include "receiver/mesh_regions.hpp"
#include "receiver/region_surgery.hpp"

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

// Fewer vertices are removed before regions for that are found.
constexpr std::size_t kWorthRegions = 2048;

// Leaves alone what comes too near to another region.
class Remover {
  public:
    Remover(SurfaceMesh& mesh, RegionSurgery surgery) : mesh_(mesh), surgery_(std::move(surgery)) {}

    bool remove(VertexId v, const Bounds& bounds) {
        if (!may_touch(v)) return false;
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
        surgery_.collapse(best);
        queue_.clear();
        for (const VertexId u : ring_) {
            mesh_.for_each_outgoing(u, [&](HalfedgeId h) { queue_.push_back(h); });
        }
        surgery_.flip_to_delaunay(queue_);
        return true;
    }

    void finish() { surgery_.finish(); }

  private:
    // Its ring and all faces around that are those of one region.
    [[nodiscard]] bool may_touch(VertexId v) const {
        // Where v is at a border itself, its fan is not to be walked around.
        bool may = surgery_.may_change(SurfaceMesh::face_of(mesh_.outgoing(v)));
        if (!may) return false;
        mesh_.for_each_outgoing(
            v, [&](HalfedgeId h) { may = may && surgery_.may_change(SurfaceMesh::face_of(h)); });
        return may;
    }

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
    RegionSurgery surgery_;
    std::vector<VertexId> ring_;
    std::vector<HalfedgeId> queue_;
};

// Removes those that the bounds allow and that lie well within a region.
void remove_in_regions(SurfaceMesh& mesh, const MeshRegions& regions, unsigned threads,
                       const Bounds& bounds, std::vector<VertexId>& left) {
    const std::vector<std::vector<std::uint32_t>> parts = regions.share_out(
        left.size(), [&](std::size_t i) { return SurfaceMesh::face_of(mesh.outgoing(left[i])); });
    std::vector<Remover> removers(regions.count(), Remover(mesh, RegionSurgery(mesh, regions, {})));
    regions.for_each(threads, [&](std::size_t region) {
        for (const std::uint32_t i : parts[region]) removers[region].remove(left[i], bounds);
    });
    for (Remover& remover : removers) remover.finish();
    std::erase_if(left, [&](VertexId v) { return !mesh.vertex_alive(v); });
}

}  // namespace

std::size_t remove_vertices(SurfaceMesh& mesh, const std::function<bool(VertexId)>& removable,
                            unsigned threads) {
    std::vector<VertexId> left;
    for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
        if (mesh.vertex_alive(v) && removable(v)) left.push_back(v);
    }
    for (const bool shifted : {false, true}) {
        if (left.size() < kWorthRegions) break;
        const MeshRegions regions(mesh, shifted, threads);
        if (regions.count() == 1) break;
        remove_in_regions(mesh, regions, threads, kPasses[0], left);
    }
    Remover remover(mesh, RegionSurgery(mesh));
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
