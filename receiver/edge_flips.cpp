// receiver/edge_flips.cpp
#include "receiver/edge_flips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace ellicast::receiver {
namespace {

// A face may not turn further than this by a Delaunay flip (cosine): beyond, the two faces do not
// lie on one smooth piece of surface and the planar criterion says nothing.
constexpr double kMinTurnCosine = 0.5;
// Delaunay within rounding: cocircular points would flip for ever.
constexpr double kDelaunayTolerance = 1e-9;
// Triangle quality below which a smoothing flip may not go, unless it was lower before.
constexpr double kThinnest = 0.02;

using Eigen::Vector3d;

struct Quad {
    std::array<VertexId, 4> id;  // a b c d: edge a -> b with c on its left, d on its right
    Vector3d a, b, c, d;
};

Quad quad_of(const SurfaceMesh& mesh, HalfedgeId h) {
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
bool violates_delaunay(const Quad& q) {
    const Vector3d ca = q.a - q.c;
    const Vector3d cb = q.b - q.c;
    const Vector3d da = q.a - q.d;
    const Vector3d db = q.b - q.d;
    const double sin_c = ca.cross(cb).norm();
    const double sin_d = da.cross(db).norm();
    const double cos_c = ca.dot(cb);
    const double cos_d = da.dot(db);
    const double scale = ca.norm() * cb.norm() * da.norm() * db.norm();
    return cos_c * sin_d + cos_d * sin_c < -kDelaunayTolerance * scale;
}

// Both new faces must look the way the two old ones do together.
bool keeps_orientation(const Quad& q, double min_cosine) {
    const Vector3d n_old =
        normal_of(q.a, q.b, q.c).normalized() + normal_of(q.b, q.a, q.d).normalized();
    const Vector3d n1 = normal_of(q.c, q.d, q.b);
    const Vector3d n2 = normal_of(q.d, q.c, q.a);
    const double limit = min_cosine * n_old.norm();
    return n1.dot(n_old) > limit * n1.norm() && n2.dot(n_old) > limit * n2.norm();
}

double angle_between(const Vector3d& n1, const Vector3d& n2) {
    return std::atan2(n1.cross(n2).norm(), n1.dot(n2));
}

// Sum of length x dihedral angle over the edge and the four around it, with the faces (a b c), (b a
// d) or, flipped, (c d b), (d c a). `outer` are the normals beyond bc, ca, ad, db.
struct FlipCost {
    double now;
    double flipped;
};

FlipCost flip_cost(const Quad& q, const std::array<Vector3d, 4>& outer) {
    const Vector3d abc = normal_of(q.a, q.b, q.c);
    const Vector3d bad = normal_of(q.b, q.a, q.d);
    const Vector3d cdb = normal_of(q.c, q.d, q.b);
    const Vector3d dca = normal_of(q.d, q.c, q.a);
    const double bc = (q.b - q.c).norm();
    const double ca = (q.c - q.a).norm();
    const double ad = (q.a - q.d).norm();
    const double db = (q.d - q.b).norm();
    const double now = (q.a - q.b).norm() * angle_between(abc, bad) +
                       bc * angle_between(abc, outer[0]) + ca * angle_between(abc, outer[1]) +
                       ad * angle_between(bad, outer[2]) + db * angle_between(bad, outer[3]);
    const double flipped = (q.c - q.d).norm() * angle_between(cdb, dca) +
                           bc * angle_between(cdb, outer[0]) + ca * angle_between(dca, outer[1]) +
                           ad * angle_between(dca, outer[2]) + db * angle_between(cdb, outer[3]);
    return {now, flipped};
}

double mean_edge_length(const SurfaceMesh& mesh) {
    double sum = 0.0;
    std::size_t count = 0;
    for (FaceId f = 0; f < mesh.face_slots(); ++f) {
        if (!mesh.face_alive(f)) continue;
        for (unsigned corner = 0; corner < 3; ++corner) {
            const HalfedgeId h = SurfaceMesh::halfedge(f, corner);
            sum += (mesh.position(mesh.from_vertex(h)) - mesh.position(mesh.to_vertex(h))).norm();
            ++count;
        }
    }
    return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

bool smoothing_flip_pays(const SurfaceMesh& mesh, HalfedgeId h, double min_gain) {
    const HalfedgeId t = mesh.twin(h);
    const Quad q = quad_of(mesh, h);
    const auto outer_normal = [&](HalfedgeId side) {
        return mesh.area_normal(SurfaceMesh::face_of(mesh.twin(side)));
    };
    const std::array<Vector3d, 4> outer = {
        outer_normal(SurfaceMesh::next(h)), outer_normal(SurfaceMesh::prev(h)),
        outer_normal(SurfaceMesh::next(t)), outer_normal(SurfaceMesh::prev(t))};
    const FlipCost cost = flip_cost(q, outer);
    if (!(cost.now - cost.flipped > min_gain)) return false;
    const double thin_now =
        std::min(triangle_quality(q.a, q.b, q.c), triangle_quality(q.b, q.a, q.d));
    const double thin_new =
        std::min(triangle_quality(q.c, q.d, q.b), triangle_quality(q.d, q.c, q.a));
    return thin_new >= std::min(kThinnest, thin_now);
}

}  // namespace

double triangle_quality(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    if (!(sides > 0.0)) return 0.0;
    return 2.0 * std::numbers::sqrt3 * normal_of(a, b, c).norm() / sides;
}

std::size_t flip_to_delaunay(SurfaceMesh& mesh, std::vector<HalfedgeId>& queue) {
    std::size_t flips = 0;
    while (!queue.empty()) {
        const HalfedgeId h = queue.back();
        queue.pop_back();
        const Quad q = quad_of(mesh, h);
        if (!violates_delaunay(q) || !keeps_orientation(q, kMinTurnCosine) || !mesh.can_flip(h)) {
            continue;
        }
        mesh.flip(h);
        ++flips;
        const HalfedgeId t = mesh.twin(h);
        for (const HalfedgeId side : {SurfaceMesh::next(h), SurfaceMesh::prev(h),
                                      SurfaceMesh::next(t), SurfaceMesh::prev(t)}) {
            queue.push_back(side);
        }
    }
    return flips;
}

std::size_t flip_all_to_delaunay(SurfaceMesh& mesh) {
    std::vector<HalfedgeId> queue;
    for (FaceId f = 0; f < mesh.face_slots(); ++f) {
        if (!mesh.face_alive(f)) continue;
        for (unsigned corner = 0; corner < 3; ++corner) {
            const HalfedgeId h = SurfaceMesh::halfedge(f, corner);
            if (h < mesh.twin(h)) queue.push_back(h);
        }
    }
    return flip_to_delaunay(mesh, queue);
}

std::size_t flip_to_smooth(SurfaceMesh& mesh, const SmoothingFlips& options) {
    const double min_gain = options.min_gain * mean_edge_length(mesh);
    std::vector<char> doubtful(3 * mesh.face_slots(), 1);
    std::size_t flips = 0;
    for (int pass = 0; pass < options.passes; ++pass) {
        std::size_t here = 0;
        for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
            if (!doubtful[h]) continue;
            doubtful[h] = 0;
            if (!mesh.face_alive(SurfaceMesh::face_of(h)) || mesh.twin(h) < h) continue;
            if (!smoothing_flip_pays(mesh, h, min_gain) || !mesh.can_flip(h)) continue;
            mesh.flip(h);
            ++here;
            // The costs of the edges of the two faces and of their neighbours' edges have changed.
            for (const HalfedgeId e : {h, mesh.twin(h)}) {
                for (const HalfedgeId side : {SurfaceMesh::next(e), SurfaceMesh::prev(e)}) {
                    const HalfedgeId beyond = mesh.twin(side);
                    for (const HalfedgeId x :
                         {side, beyond, SurfaceMesh::next(beyond), SurfaceMesh::prev(beyond)}) {
                        doubtful[std::min(x, mesh.twin(x))] = 1;
                    }
                }
            }
        }
        flips += here;
        if (here == 0) break;
    }
    return flips;
}

}  // namespace ellicast::receiver
