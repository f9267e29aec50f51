// receiver/vertex_insertion.cpp
#include "receiver/vertex_insertion.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "receiver/closest_triangles.hpp"
#include "receiver/mesh_regions.hpp"
#include "receiver/region_surgery.hpp"
#include "receiver/surface_walk.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

// Below this barycentric coordinate a 1-to-3 split would leave a needle: split the edge (DESIGN
// section 4).
constexpr double kEdgeCoordinate = 0.02;
// Above this one the projection is as good as the corner.
constexpr double kCornerCoordinate = 0.9;
constexpr double kSamePointCoordinate = 0.999;
// Fewer points go in before regions for them are found.
constexpr std::size_t kWorthRegions = 4096;

struct Target {
    std::uint32_t point;
    FaceId face;  // of the surface at entry
    Vector3d at;
};

std::vector<Target> project(const PointSurface& surface, std::span<const Vector3d> points,
                            std::span<const std::uint32_t> chosen, unsigned threads) {
    // The extracted mesh numbers live faces; `slot` leads back.
    std::vector<FaceId> slot;
    slot.reserve(surface.mesh.face_slots());
    for (FaceId f = 0; f < surface.mesh.face_slots(); ++f) {
        if (surface.mesh.face_alive(f)) slot.push_back(f);
    }
    std::vector<Vector3d> positions(chosen.size());
    std::transform(chosen.begin(), chosen.end(), positions.begin(),
                   [&](std::uint32_t point) { return points[point]; });
    std::vector<Target> targets(chosen.size());
    visit_closest_triangles(
        surface.mesh.extract(), positions, threads,
        [&](std::uint32_t triangle, const Vector3d& x) {
            return walk_to_closest(surface.mesh, slot[triangle], x).squared_distance;
        },
        [&](std::size_t k, std::size_t i, const common::TriangleTree::Hit& hit) {
            targets[k] = {chosen[i], slot[hit.triangle], hit.point};
        });
    return targets;
}

// Puts points in; off what comes too near to another region.
class Inserter {
  public:
    Inserter(PointSurface& surface, RegionSurgery surgery)
        : surface_(surface), mesh_(surface.mesh), surgery_(std::move(surgery)) {}

    void insert(const Target& target) {
        const std::optional<SurfacePlace> place = find(target);
        if (!place) {
            put_off_.push_back(target);
            return;
        }
        const auto corners = mesh_.face(place->face);
        int largest = 0;
        place->barycentric.maxCoeff(&largest);
        const double top = place->barycentric[largest];
        const VertexId corner = corners[static_cast<std::size_t>(largest)];
        const bool free_corner = surface_.point_of_vertex[corner] == kNone;
        if (free_corner && top > kCornerCoordinate && can_move(corner, target.at)) {
            mesh_.set_position(corner, target.at);
            surface_.point_of_vertex[corner] = target.point;
            flip_around(corner);
        } else if (top > kSamePointCoordinate) {
            left_out_.push_back(target.point);
        } else {
            split(*place, target);
        }
    }

    // Those that all but met an earlier one.
    [[nodiscard]] const std::vector<std::uint32_t>& left_out() const { return left_out_; }
    [[nodiscard]] const std::vector<Target>& put_off() const { return put_off_; }
    void finish() { surgery_.finish(); }

  private:
    [[nodiscard]] std::optional<SurfacePlace> find(const Target& target) const {
        const FaceId start = target.face == last_face_ && last_vertex_ != kNone
                                 ? SurfaceMesh::face_of(mesh_.outgoing(last_vertex_))
                                 : target.face;
        return surgery_.walk(start, target.at);
    }

    void split(const SurfacePlace& place, const Target& target) {
        int smallest = 0;
        VertexId v = kNone;
        if (place.barycentric.minCoeff(&smallest) < kEdgeCoordinate) {
            const auto corner = static_cast<unsigned>((smallest + 1) % 3);
            const HalfedgeId h = SurfaceMesh::halfedge(place.face, corner);
            if (!surgery_.may_change(SurfaceMesh::face_of(mesh_.twin(h)))) {
                put_off_.push_back(target);
                return;
            }
            v = surgery_.split_edge(h, target.at);
        } else {
            v = surgery_.split_face(place.face, target.at);
        }
        if (v >= surface_.point_of_vertex.size()) surface_.point_of_vertex.resize(v + 1, kNone);
        surface_.point_of_vertex[v] = target.point;
        flip_around(v);
        last_face_ = target.face;
        last_vertex_ = v;
    }

    // Moving v to p must not turn any face at v over.
    [[nodiscard]] bool can_move(VertexId v, const Vector3d& p) const {
        bool ok = true;
        mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
            const Vector3d& b = mesh_.position(mesh_.to_vertex(h));
            const Vector3d& c = mesh_.position(mesh_.opposite(h));
            const Vector3d before = mesh_.area_normal(SurfaceMesh::face_of(h));
            ok = ok && (b - p).cross(c - p).dot(before) > 0.0;
        });
        return ok;
    }

    void flip_around(VertexId v) {
        queue_.clear();
        mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
            queue_.push_back(SurfaceMesh::next(h));
            queue_.push_back(h);
        });
        surgery_.flip_to_delaunay(queue_);
    }

    PointSurface& surface_;
    SurfaceMesh& mesh_;
    RegionSurgery surgery_;
    FaceId last_face_ = kNone;      // of the last target that became a new vertex,
    VertexId last_vertex_ = kNone;  // which the next one of that face is near
    std::vector<HalfedgeId> queue_;
    std::vector<std::uint32_t> left_out_;
    std::vector<Target> put_off_;
};

// How many targets each face slot has.
std::vector<std::uint32_t> targets_per_face(const SurfaceMesh& mesh,
                                            std::span<const Target> targets) {
    std::vector<std::uint32_t> count(mesh.face_slots(), 0);
    for (const Target& target : targets) ++count[target.face];
    return count;
}

// Face slots run in grid order, so that neighbours in this order are neighbours on the surface.
void sort_by_face(const SurfaceMesh& mesh, std::vector<Target>& targets) {
    std::vector<std::uint32_t> next(mesh.face_slots() + 1, 0);
    for (const Target& target : targets) ++next[target.face + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<Target> sorted(targets.size());
    for (const Target& target : targets) sorted[next[target.face]++] = target;
    targets = std::move(sorted);
}

// Inserts what lies well within the regions, each of which a thread has; keeps the rest in
// `targets`.
void insert_in_regions(PointSurface& surface, const MeshRegions& regions, unsigned threads,
                       std::vector<Target>& targets, std::vector<std::uint32_t>& left_out) {
    SurfaceMesh& mesh = surface.mesh;
    const std::vector<std::vector<std::uint32_t>> parts =
        regions.share_out(targets.size(), [&](std::size_t i) { return targets[i].face; });
    std::vector<Inserter> inserters;
    inserters.reserve(parts.size());
    for (const std::vector<std::uint32_t>& part : parts) {
        inserters.emplace_back(surface, RegionSurgery(mesh, regions, mesh.take_slots(part.size())));
    }
    surface.point_of_vertex.resize(mesh.vertex_slots(), kNone);
    regions.for_each(threads, [&](std::size_t region) {
        for (const std::uint32_t i : parts[region]) inserters[region].insert(targets[i]);
    });
    std::vector<Target> left;
    for (Inserter& inserter : inserters) {
        const auto& put_off = inserter.put_off();
        left.insert(left.end(), put_off.begin(), put_off.end());
        left_out.insert(left_out.end(), inserter.left_out().begin(), inserter.left_out().end());
        inserter.finish();
    }
    targets = std::move(left);
}

}  // namespace

std::vector<std::uint32_t> insert_points(PointSurface& surface, std::span<const Vector3d> points,
                                         std::span<const std::uint32_t> chosen, unsigned threads) {
    std::vector<std::uint32_t> ascending(chosen.begin(), chosen.end());
    if (!std::is_sorted(ascending.begin(), ascending.end())) {
        std::sort(ascending.begin(), ascending.end());
    }
    std::vector<Target> targets = project(surface, points, ascending, threads);
    sort_by_face(surface.mesh, targets);
    surface.mesh.reserve(targets.size());
    surface.point_of_vertex.reserve(surface.point_of_vertex.size() + targets.size());
    std::vector<std::uint32_t> left_out;
    for (const bool shifted : {false, true}) {
        if (targets.size() < kWorthRegions) break;
        const MeshRegions regions(surface.mesh, shifted, threads,
                                  targets_per_face(surface.mesh, targets));
        if (regions.count() == 1) break;
        insert_in_regions(surface, regions, threads, targets, left_out);
    }
    Inserter inserter(surface, RegionSurgery(surface.mesh));
    for (const Target& target : targets) inserter.insert(target);
    left_out.insert(left_out.end(), inserter.left_out().begin(), inserter.left_out().end());
    std::sort(left_out.begin(), left_out.end());
    return left_out;
}

void shift_to_points(PointSurface& surface, std::span<const Vector3d> points) {
    for (VertexId v = 0; v < surface.mesh.vertex_slots(); ++v) {
        const std::uint32_t point = surface.point_of_vertex[v];
        if (point != kNone && surface.mesh.vertex_alive(v)) {
            surface.mesh.set_position(v, points[point]);
        }
    }
}

}  // namespace ellicast::receiver
