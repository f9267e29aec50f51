// receiver/edge_flips.cpp
#include "receiver/edge_flips.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace ellicast::receiver {
namespace {

// A face may not turn further than this by a Delaunay flip (cosine): beyond, the two faces do not
// lie on one smooth piece of surface and the planar criterion says nothing.
constexpr double kMinTurnCosine = 0.5;
// Delaunay within rounding: cocircular points would flip for ever.
constexpr double kDelaunayTolerance = 1e-9;

using Eigen::Vector3d;

struct Corners {
    std::array<VertexId, 4> id;  // a b c d: edge a -> b with c on its left, d on its right
    Vector3d a, b, c, d;
};

Corners corners_of(const SurfaceMesh& mesh, HalfedgeId h) {
    const HalfedgeId t = mesh.twin(h);
    const std::array<VertexId, 4> id = {mesh.from_vertex(h), mesh.to_vertex(h), mesh.opposite(h),
                                        mesh.opposite(t)};
    return {id, mesh.position(id[0]), mesh.position(id[1]), mesh.position(id[2]),
            mesh.position(id[3])};
}

Vector3d normal_of(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    return (b - a).cross(c - a);
}

// cot(angle at c) + cot(angle at d) < 0: the angles sum to more than 180 degrees.
bool violates_delaunay(const Corners& q) {
    const Vector3d ca = q.a - q.c;
    const Vector3d cb = q.b - q.c;
    const Vector3d da = q.a - q.d;
    const Vector3d db = q.b - q.d;
    const double cos_c = ca.dot(cb);
    const double cos_d = da.dot(db);
    if (cos_c >= 0.0 && cos_d >= 0.0) return false;  // most edges
    const double sin_c = ca.cross(cb).norm();
    const double sin_d = da.cross(db).norm();
    const double scale =
        std::sqrt(ca.squaredNorm() * cb.squaredNorm() * (da.squaredNorm() * db.squaredNorm()));
    return cos_c * sin_d + cos_d * sin_c < -kDelaunayTolerance * scale;
}

// Both new faces must look the way the two old ones do together.
bool keeps_orientation(const Corners& q, double min_cosine) {
    const Vector3d n_old =
        normal_of(q.a, q.b, q.c).normalized() + normal_of(q.b, q.a, q.d).normalized();
    const Vector3d n1 = normal_of(q.c, q.d, q.b);
    const Vector3d n2 = normal_of(q.d, q.c, q.a);
    const double limit = min_cosine * n_old.norm();
    return n1.dot(n_old) > limit * n1.norm() && n2.dot(n_old) > limit * n2.norm();
}

// Edges that are not `near` are left out.
template <class Near>
std::size_t flip_near(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue, const Near& near) {
    std::size_t flips = 0;
    while (!queue.empty()) {
        const HalfedgeId h = queue.back();
        queue.pop_back();
        if (!near(h)) continue;
        const Corners q = corners_of(mesh, h);
        if (!violates_delaunay(q) || !keeps_orientation(q, kMinTurnCosine) || !mesh.can_flip(h)) {
            continue;
        }
        mesh.flip(h);
        ++flips;
        for (const HalfedgeId side : sides_of(mesh, h)) queue.push_back(side);
    }
    return flips;
}

}  // namespace

std::array<HalfedgeId, 4> sides_of(const SurfaceMesh& mesh, HalfedgeId h) {
    const HalfedgeId t = mesh.twin(h);
    return {SurfaceMesh::next(h), SurfaceMesh::prev(h), SurfaceMesh::next(t), SurfaceMesh::prev(t)};
}

double triangle_quality(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    if (!(sides > 0.0)) return 0.0;
    return 2.0 * std::numbers::sqrt3 * normal_of(a, b, c).norm() / sides;
}

std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue) {
    return flip_near(mesh, queue, [](HalfedgeId) { return true; });
}

std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue,
                             const MeshRegions& regions, std::vector<HalfedgeId>& put_off) {
    return flip_near(mesh, queue, [&](HalfedgeId h) {
        const bool near = is_inner(mesh, regions, h);
        if (!near) put_off.push_back(h);
        return near;
    });
}

std::size_t flip_all_to_delaunay(SurfaceMesh& mesh, unsigned threads) {
    const MeshRegions regions(mesh, false, threads);
    std::vector<std::vector<HalfedgeId>> put_off(regions.count());
    std::vector<std::size_t> made(regions.count(), 0);
    regions.for_each(threads, [&](std::size_t region) {
        std::vector<HalfedgeId> queue;
        for (const FaceId f : regions.faces(region)) {
            for (unsigned corner = 0; corner < 3; ++corner) {
                const HalfedgeId h = SurfaceMesh::halfedge(f, corner);
                if (!stands_for_edge(mesh, h)) continue;
                if (!is_inner(mesh, regions, h)) {
                    put_off[region].push_back(h);
                } else if (violates_delaunay(corners_of(mesh, h))) {
                    queue.push_back(h);
                }
            }
        }
        made[region] = flip_to_delaunay(mesh, queue, regions, put_off[region]);
    });
    std::size_t flips = std::accumulate(made.begin(), made.end(), std::size_t{0});
    for (std::vector<HalfedgeId>& queue : put_off) flips += flip_to_delaunay(mesh, queue);
    return flips;
}

}  // namespace ellicast::receiver
