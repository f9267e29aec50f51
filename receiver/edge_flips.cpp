// receiver/edge_flips.cpp
#include "receiver/edge_flips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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
    const double sin_c = ca.cross(cb).norm();
    const double sin_d = da.cross(db).norm();
    const double cos_c = ca.dot(cb);
    const double cos_d = da.dot(db);
    const double scale = ca.norm() * cb.norm() * da.norm() * db.norm();
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

// How much a first flip may cost, in the same unit, when a second one is to make up for it.
constexpr double kLookAhead = 1.0;

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
double smoothing_gain(const SurfaceMesh& mesh, HalfedgeId h, double unit,
                      const FlipCriterion& criterion) {
    const HalfedgeId t = mesh.twin(h);
    const Corners q = corners_of(mesh, h);
    const auto settled = [&](VertexId v) { return criterion.settled[v] != 0; };
    if (!criterion.settled.empty() && std::any_of(q.id.begin(), q.id.end(), settled)) {
        return -std::numeric_limits<double>::infinity();
    }
    const double thin_now =
        std::min(triangle_quality(q.a, q.b, q.c), triangle_quality(q.b, q.a, q.d));
    const double thin_new =
        std::min(triangle_quality(q.c, q.d, q.b), triangle_quality(q.d, q.c, q.a));
    if (thin_new < std::min(kThinnest, thin_now)) return -std::numeric_limits<double>::infinity();
    const auto outer_normal = [&](HalfedgeId side) {
        return mesh.area_normal(SurfaceMesh::face_of(mesh.twin(side)));
    };
    common::Quad quad{q.a, q.b, q.c, q.d, {}, {}};
    quad.outer_normals = {outer_normal(SurfaceMesh::next(h)), outer_normal(SurfaceMesh::prev(h)),
                          outer_normal(SurfaceMesh::next(t)), outer_normal(SurfaceMesh::prev(t))};
    for (std::size_t k = 0; k < 4; ++k) {
        quad.vertex_normals[k] =
            criterion.normals.empty() ? Vector3d::Zero().eval() : criterion.normals[q.id[k]];
    }
    return common::diagonal_gain(quad).weighed(criterion.weights.angle, criterion.weights.rise,
                                               unit);
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
        if (!(smoothing_gain(mesh_, h, unit_, criterion_) > common::kLeastDiagonalGain * unit_) ||
            !mesh_.can_flip(h))
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
        double gain =
            common::kLeastDiagonalGain * unit_ - first;  // that the second flip has to beat
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
