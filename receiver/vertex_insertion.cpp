// receiver/vertex_insertion.cpp
#include "receiver/vertex_insertion.hpp"

#include <algorithm>
#include <tuple>

#include "receiver/closest_triangles.hpp"
#include "receiver/edge_flips.hpp"
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
struct Target {
    std::uint32_t point;
    FaceId face;  // of the surface at entry
    Vector3d at;
};

std::vector<Target> project(const PointSurface& surface, std::span<const Vector3d> points,
                            std::span<const std::uint32_t> chosen, unsigned threads) {
    // The extracted mesh numbers live faces; `slot` leads back.
    std::vector<FaceId> slot;
    for (FaceId f = 0; f < surface.mesh.face_slots(); ++f) {
        if (surface.mesh.face_alive(f)) slot.push_back(f);
    }
    std::vector<Vector3d> positions(chosen.size());
    std::transform(chosen.begin(), chosen.end(), positions.begin(),
                   [&](std::uint32_t point) { return points[point]; });
    std::vector<Target> targets(chosen.size());
    visit_closest_triangles(surface.mesh.extract(), positions, threads,
                            [&](std::size_t i, const common::TriangleTree::Hit& hit) {
                                targets[i] = {chosen[i], slot[hit.triangle], hit.point};
                            });
    return targets;
}

class Inserter {
  public:
    explicit Inserter(PointSurface& surface) : surface_(surface), mesh_(surface.mesh) {}

    // True when the point is a vertex now.
    bool insert(const Target& target) {
        const SurfacePlace place = walk_to_closest(mesh_, target.face, target.at);
        const auto corners = mesh_.face(place.face);
        int largest = 0;
        place.barycentric.maxCoeff(&largest);
        const double top = place.barycentric[largest];
        const VertexId corner = corners[static_cast<std::size_t>(largest)];
        const bool free_corner = surface_.point_of_vertex[corner] == kNone;
        if (free_corner && top > kCornerCoordinate && can_move(corner, target.at)) {
            mesh_.set_position(corner, target.at);
            surface_.point_of_vertex[corner] = target.point;
            flip_around(corner);
            return true;
        }
        if (top > kSamePointCoordinate) return false;
        const VertexId v = split(place, target.at);
        surface_.point_of_vertex.push_back(target.point);
        flip_around(v);
        return true;
    }

  private:
    VertexId split(const SurfacePlace& place, const Vector3d& at) {
        int smallest = 0;
        if (place.barycentric.minCoeff(&smallest) < kEdgeCoordinate) {
            const auto corner = static_cast<unsigned>((smallest + 1) % 3);
            return mesh_.split_edge(SurfaceMesh::halfedge(place.face, corner), at);
        }
        return mesh_.split_face(place.face, at);
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
        flip_to_delaunay(mesh_, queue_);
    }

    PointSurface& surface_;
    SurfaceMesh& mesh_;
    std::vector<HalfedgeId> queue_;
};

}  // namespace

std::vector<std::uint32_t> insert_points(PointSurface& surface, std::span<const Vector3d> points,
                                         std::span<const std::uint32_t> chosen, unsigned threads) {
    std::vector<Target> targets = project(surface, points, chosen, threads);
    // Face slots run in grid order, so neighbours in this order are neighbours on the surface.
    std::sort(targets.begin(), targets.end(), [](const Target& a, const Target& b) {
        return std::tie(a.face, a.point) < std::tie(b.face, b.point);
    });
    surface.mesh.reserve(targets.size());
    surface.point_of_vertex.reserve(surface.point_of_vertex.size() + targets.size());
    std::vector<std::uint32_t> left_out;
    Inserter inserter(surface);
    for (const Target& target : targets) {
        if (!inserter.insert(target)) left_out.push_back(target.point);
    }
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
