// receiver/surface_walk.cpp
#include "receiver/surface_walk.hpp"

#include "common/triangle_point.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

// Steps before the walk stays where it is: the start should be next to the goal.
constexpr int kMaxWalk = 64;

// When the closest point is a corner, the way on may lead through any face at that corner.
SurfacePlace best_around_corner(const SurfaceMesh& mesh, const SurfacePlace& place,
                                const Vector3d& x) {
    int largest = 0;
    if (place.barycentric.maxCoeff(&largest) < 1.0) return place;
    SurfacePlace best = place;
    const VertexId v = mesh.face(place.face)[static_cast<std::size_t>(largest)];
    const Vector3d& p = mesh.position(v);
    const Vector3d d = x - p;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
        // Nothing of a face that lies behind its corner is nearer than that.
        if (d.dot(mesh.position(mesh.to_vertex(h)) - p) <= 0.0 &&
            d.dot(mesh.position(mesh.opposite(h)) - p) <= 0.0) {
            return;
        }
        const SurfacePlace here = place_on_face(mesh, SurfaceMesh::face_of(h), x);
        if (here.squared_distance < best.squared_distance) best = here;
    });
    return best;
}

SurfacePlace best_beyond_edges(const SurfaceMesh& mesh, const SurfacePlace& place,
                               const Vector3d& x) {
    SurfacePlace best = place;
    for (unsigned corner = 0; corner < 3; ++corner) {
        // The closest point lies on the edge opposite a corner of weight zero.
        if (place.barycentric[static_cast<int>((corner + 2) % 3)] > 0.0) continue;
        const HalfedgeId h = SurfaceMesh::halfedge(place.face, corner);
        const SurfacePlace beyond = place_on_face(mesh, SurfaceMesh::face_of(mesh.twin(h)), x);
        if (beyond.squared_distance < best.squared_distance) best = beyond;
    }
    return best;
}

// The best place, if all faces on the way may be left.
template <class MayLeave>
std::optional<SurfacePlace> walk(const SurfaceMesh& mesh, FaceId start, const Vector3d& x,
                                 const MayLeave& may_leave) {
    SurfacePlace best = place_on_face(mesh, start, x);
    for (int step = 0; step < kMaxWalk; ++step) {
        if (!may_leave(best.face)) return std::nullopt;
        SurfacePlace next = best_beyond_edges(mesh, best, x);
        if (next.face == best.face) next = best_around_corner(mesh, best, x);
        if (next.face == best.face) break;
        best = next;
    }
    return best;
}

}  // namespace

SurfacePlace place_on_face(const SurfaceMesh& mesh, FaceId face, const Vector3d& x) {
    const auto [a, b, c] = mesh.face(face);
    const common::TrianglePoint hit =
        common::closest_point_on_triangle(x, mesh.position(a), mesh.position(b), mesh.position(c));
    return {face, hit.point, hit.barycentric, (x - hit.point).squaredNorm()};
}

SurfacePlace walk_to_closest(const SurfaceMesh& mesh, FaceId start, const Vector3d& x) {
    return *walk(mesh, start, x, [](FaceId) { return true; });
}

std::optional<SurfacePlace> walk_to_closest(const SurfaceMesh& mesh, FaceId start,
                                            const Vector3d& x, const MeshRegions& regions) {
    const auto may_leave = [&](FaceId f) { return regions.inner(f); };
    const std::optional<SurfacePlace> place = walk(mesh, start, x, may_leave);
    return place && may_leave(place->face) ? place : std::nullopt;
}

}  // namespace ellicast::receiver
