// receiver/edge_flips.cpp
#include "receiver/edge_flips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
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

// Weight of an edge's own length beside length x dihedral angle, in radians: where the surface is
// flat within about this angle the shorter diagonal wins, as in most meshes that people make.
constexpr double kLengthWeight = 0.1;
// A flip must gain this many radians times the mean edge length, or ties would flip back and forth.
constexpr double kMinGain = 0.02;
// How much a first flip may cost, in the same unit, when a second one is to make up for it.
constexpr double kLookAhead = 1.0;

// Cost of the edge and the four around it, with the faces (a b c), (b a d) or, flipped, (c d b), (d
// c a). `outer` are the normals beyond bc, ca, ad, db.
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
    const double ab = (q.a - q.b).norm();
    const double cd = (q.c - q.d).norm();
    const double now = ab * (kLengthWeight + angle_between(abc, bad)) +
                       bc * angle_between(abc, outer[0]) + ca * angle_between(abc, outer[1]) +
                       ad * angle_between(bad, outer[2]) + db * angle_between(bad, outer[3]);
    const double flipped = cd * (kLengthWeight + angle_between(cdb, dca)) +
                           bc * angle_between(cdb, outer[0]) + ca * angle_between(dca, outer[1]) +
                           ad * angle_between(dca, outer[2]) + db * angle_between(cdb, outer[3]);
    return {now, flipped};
}

// By how much the angles opposite this edge exceed those opposite the other diagonal, in radians.
double delaunay_excess(const Quad& q) {
    return angle_between(q.a - q.c, q.b - q.c) + angle_between(q.a - q.d, q.b - q.d) -
           angle_between(q.c - q.a, q.d - q.a) - angle_between(q.c - q.b, q.d - q.b);
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

// What flipping h gains; minus infinity when the flip leaves a needle.
// How far the surface rises above the middle of an edge, after the normals at its ends.
double rise(const Vector3d& p, const Vector3d& q, const Vector3d& n, const Vector3d& m) {
    return (q - p).dot(m - n) / 8.0;
}

// How much nearer the other diagonal of the quad comes to the surface that the normals ask for, as
// far as both diagonals' ends agree on it: at creases they don't, and the normals say nothing.
double height_gain(const Quad& q, std::span<const Vector3d> normals) {
    const Vector3d up = (normal_of(q.a, q.b, q.c) + normal_of(q.b, q.a, q.d)).normalized();
    const double z = 0.5 * (q.c + q.d - q.a - q.b).dot(up);
    const double over_ab = rise(q.a, q.b, normals[q.id[0]], normals[q.id[1]]);
    const double over_cd = z + rise(q.c, q.d, normals[q.id[2]], normals[q.id[3]]);
    const auto nearer = [z](double surface) { return std::abs(surface) - std::abs(surface - z); };
    const double after_ab = nearer(over_ab);
    const double after_cd = nearer(over_cd);
    if (after_ab > 0.0 && after_cd > 0.0) return std::min(after_ab, after_cd);
    if (after_ab < 0.0 && after_cd < 0.0) return std::max(after_ab, after_cd);
    return 0.0;
}

double smoothing_gain(const SurfaceMesh& mesh, HalfedgeId h, double unit,
                      const FlipCriterion& criterion) {
    const HalfedgeId t = mesh.twin(h);
    const Quad q = quad_of(mesh, h);
    const double thin_now =
        std::min(triangle_quality(q.a, q.b, q.c), triangle_quality(q.b, q.a, q.d));
    const double thin_new =
        std::min(triangle_quality(q.c, q.d, q.b), triangle_quality(q.d, q.c, q.a));
    if (thin_new < std::min(kThinnest, thin_now)) return -std::numeric_limits<double>::infinity();
    const auto outer_normal = [&](HalfedgeId side) {
        return mesh.area_normal(SurfaceMesh::face_of(mesh.twin(side)));
    };
    const FlipCost cost =
        flip_cost(q, {outer_normal(SurfaceMesh::next(h)), outer_normal(SurfaceMesh::prev(h)),
                      outer_normal(SurfaceMesh::next(t)), outer_normal(SurfaceMesh::prev(t))});
    double gain = cost.now - cost.flipped;
    if (criterion.delaunay_weight > 0.0) {
        gain += criterion.delaunay_weight * unit * delaunay_excess(q);
    }
    if (criterion.height_weight > 0.0)
        gain += criterion.height_weight * height_gain(q, criterion.normals);
    return gain;
}

std::array<HalfedgeId, 4> sides_of(const SurfaceMesh& mesh, HalfedgeId h) {
    const HalfedgeId t = mesh.twin(h);
    return {SurfaceMesh::next(h), SurfaceMesh::prev(h), SurfaceMesh::next(t), SurfaceMesh::prev(t)};
}

// Sweeps over the edges in slot order, again over those that a flip made doubtful.
class Smoother {
  public:
    Smoother(SurfaceMesh& mesh, const FlipCriterion& criterion)
        : mesh_(mesh),
          criterion_(criterion),
          unit_(mean_edge_length(mesh)),
          doubtful_(3 * mesh.face_slots()) {}

    template <class Attempt>
    std::size_t sweep(int passes, const Attempt& attempt) {
        std::fill(doubtful_.begin(), doubtful_.end(), 1);
        std::size_t flips = 0;
        for (int pass = 0; pass < passes; ++pass) {
            const std::size_t before = flips;
            for (HalfedgeId h = 0; h < doubtful_.size(); ++h) {
                if (!doubtful_[h]) continue;
                doubtful_[h] = 0;
                if (mesh_.face_alive(SurfaceMesh::face_of(h)) && h < mesh_.twin(h)) {
                    flips += attempt(h);
                }
            }
            if (flips == before) break;
        }
        return flips;
    }

    std::size_t flip_one(HalfedgeId h) {
        if (!(smoothing_gain(mesh_, h, unit_, criterion_) > kMinGain * unit_) || !mesh_.can_flip(h))
            return 0;
        mesh_.flip(h);
        mark(h);
        return 1;
    }

    // Flips h and then, where that helps, one of the four edges around it; neither when both
    // together do not pay. Leads out of the local minima of flip_one: a crease two triangles wide,
    // say.
    std::size_t flip_two(HalfedgeId h) {
        const double first = smoothing_gain(mesh_, h, unit_, criterion_);
        if (!(first > -kLookAhead * unit_) || !mesh_.can_flip(h)) return 0;
        mesh_.flip(h);
        HalfedgeId second = kNone;
        double gain = kMinGain * unit_ - first;  // that the second flip has to beat
        const bool alone = gain < 0.0;
        gain = std::max(gain, 0.0);
        for (const HalfedgeId side : sides_of(mesh_, h)) {
            const double here = smoothing_gain(mesh_, side, unit_, criterion_);
            if (here > gain && mesh_.can_flip(side)) {
                second = side;
                gain = here;
            }
        }
        if (second == kNone && !alone) {
            mesh_.flip(h);  // back
            return 0;
        }
        mark(h);
        if (second == kNone) return 1;
        mesh_.flip(second);
        mark(second);
        return 2;
    }

  private:
    // A flip changes the gain of the edges of its two faces and of their neighbours' edges.
    void mark(HalfedgeId h) {
        for (const HalfedgeId side : sides_of(mesh_, h)) {
            const HalfedgeId beyond = mesh_.twin(side);
            for (const HalfedgeId x :
                 {side, SurfaceMesh::next(beyond), SurfaceMesh::prev(beyond)}) {
                doubtful_[std::min(x, mesh_.twin(x))] = 1;
            }
        }
    }

    SurfaceMesh& mesh_;
    const FlipCriterion& criterion_;
    double unit_;
    std::vector<char> doubtful_;
};

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
        for (const HalfedgeId side : sides_of(mesh, h)) queue.push_back(side);
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

std::size_t flip_to_smooth(SurfaceMesh& mesh, const FlipCriterion& criterion, int passes) {
    Smoother smoother(mesh, criterion);
    const std::size_t flips =
        smoother.sweep(passes, [&](HalfedgeId h) { return smoother.flip_one(h); });
    return flips + smoother.sweep(passes, [&](HalfedgeId h) { return smoother.flip_two(h); });
}

}  // namespace ellicast::receiver
