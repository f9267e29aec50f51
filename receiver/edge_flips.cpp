// receiver/edge_flips.cpp
#include "receiver/edge_flips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/parallel.hpp"
#include "receiver/flip_gains.hpp"

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

// How much a first flip may cost, in mean edge lengths, when a second one is to make up for it.
constexpr double kLookAhead = 1.0;

std::array<HalfedgeId, 4> sides_of(const SurfaceMesh& mesh, HalfedgeId h) {
    const HalfedgeId t = mesh.twin(h);
    return {SurfaceMesh::next(h), SurfaceMesh::prev(h), SurfaceMesh::next(t), SurfaceMesh::prev(t)};
}

// Half-edges that speak for their edges.
bool stands_for_edge(const SurfaceMesh& mesh, HalfedgeId h) {
    return mesh.face_alive(SurfaceMesh::face_of(h)) && h < mesh.twin(h);
}

// Sweeps over the edges in slot order, again over those that a flip made doubtful.
class Smoother {
  public:
    Smoother(SurfaceMesh& mesh, const FlipCriterion& criterion)
        : mesh_(mesh),
          threads_(criterion.threads),
          gains_(mesh, criterion),
          doubtful_(3 * mesh.face_slots()) {}

    // `promising(h)` reads only, and is true of every edge on which `attempt(h)` would do anything.
    template <class Promising, class Attempt>
    std::size_t sweep(int passes, const Promising& promising, const Attempt& attempt) {
        common::parallel_for(doubtful_.size(), threads_, [&](std::size_t begin, std::size_t end) {
            for (auto h = static_cast<HalfedgeId>(begin); h < end; ++h) {
                doubtful_[h] = stands_for_edge(mesh_, h) && promising(h);
            }
        });
        std::size_t flips = 0;
        for (int pass = 0; pass < passes; ++pass) {
            const std::size_t before = flips;
            for (HalfedgeId h = 0; h < doubtful_.size(); ++h) {
                if (!doubtful_[h]) continue;
                doubtful_[h] = 0;
                if (stands_for_edge(mesh_, h)) flips += attempt(h);
            }
            if (flips == before) break;
        }
        return flips;
    }

    std::size_t sweep_single_flips(int passes) {
        return sweep(
            passes,
            [&](HalfedgeId h) { return gains_.consider(h, least_gain()).gain > least_gain(); },
            [&](HalfedgeId h) { return flip_one(h); });
    }

    std::size_t sweep_pairs_of_flips(int passes) {
        return sweep(
            passes,
            [&](HalfedgeId h) { return may_pay_with_second(h, gains_.consider(h, look_ahead())); },
            [&](HalfedgeId h) { return flip_two(h); });
    }

  private:
    [[nodiscard]] double least_gain() const { return common::kLeastDiagonalGain * gains_.unit(); }

    // What a first flip must gain, when a second one is to make up for what it lacks.
    [[nodiscard]] double look_ahead() const { return -kLookAhead * gains_.unit(); }

    std::size_t flip_one(HalfedgeId h) {
        const FlipGains::Trial trial = gains_.consider(h, least_gain());
        if (!(trial.gain > least_gain()) || !mesh_.can_flip(h)) return 0;
        gains_.flip(h, trial);
        mark(h, 1);
        return 1;
    }

    // Whether flipping h, alone or with one of the edges around it, might gain enough.
    [[nodiscard]] bool may_pay_with_second(HalfedgeId h, const FlipGains::Trial& first) const {
        if (!(first.gain > look_ahead())) return false;
        return first.gain > least_gain() ||
               gains_.best_pair_gain(h, first, least_gain()) > least_gain();
    }

    // Flips h and then, where that helps, one of the four edges around it; neither when both
    // together do not pay. Leads out of the local minima of flip_one: a crease two triangles wide,
    // say.
    std::size_t flip_two(HalfedgeId h) {
        const FlipGains::Trial first = gains_.consider(h, look_ahead());
        if (!may_pay_with_second(h, first) || !mesh_.can_flip(h)) return 0;
        gains_.flip(h, first);
        const double missing = least_gain() - first.gain;  // for the second flip to beat
        const auto [second, trial] = best_beside(h, std::max(missing, 0.0));
        if (second == kNone && !(missing < 0.0)) {
            gains_.undo(h, first);
            return 0;
        }
        mark(h, 2);
        if (second == kNone) return 1;
        gains_.flip(second, trial);
        mark(second, 2);
        return 2;
    }

    // The edge around h whose flip gains most, if more than `gain`; kNone otherwise.
    std::pair<HalfedgeId, FlipGains::Trial> best_beside(HalfedgeId h, double gain) const {
        std::pair<HalfedgeId, FlipGains::Trial> best{kNone, {}};
        for (const HalfedgeId side : sides_of(mesh_, h)) {
            const FlipGains::Trial trial = gains_.consider(side, gain);
            if (trial.gain > gain && mesh_.can_flip(side)) {
                best = {side, trial};
                gain = trial.gain;
            }
        }
        return best;
    }

    // A flip changes the gain of the edges of its two faces and of their neighbours' edges, and
    // that of pairs one face further.
    void mark(HalfedgeId h, int faces) {
        for (const HalfedgeId side : sides_of(mesh_, h)) mark_beyond(side, faces);
    }
    void mark_beyond(HalfedgeId side, int faces) {
        const HalfedgeId beyond = mesh_.twin(side);
        doubtful_[std::min(side, beyond)] = 1;
        if (faces == 0) return;
        mark_beyond(SurfaceMesh::next(beyond), faces - 1);
        mark_beyond(SurfaceMesh::prev(beyond), faces - 1);
    }

    SurfaceMesh& mesh_;
    unsigned threads_;
    FlipGains gains_;
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

std::size_t flip_all_to_delaunay(SurfaceMesh& mesh, unsigned threads) {
    std::vector<char> doubtful(3 * mesh.face_slots());
    common::parallel_for(doubtful.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (auto h = static_cast<HalfedgeId>(begin); h < end; ++h) {
            doubtful[h] = stands_for_edge(mesh, h) && violates_delaunay(corners_of(mesh, h));
        }
    });
    std::vector<HalfedgeId> queue;
    for (HalfedgeId h = 0; h < doubtful.size(); ++h) {
        if (doubtful[h]) queue.push_back(h);
    }
    return flip_to_delaunay(mesh, queue);
}

std::size_t flip_to_smooth(SurfaceMesh& mesh, const FlipCriterion& criterion, int passes) {
    Smoother smoother(mesh, criterion);
    const std::size_t flips = smoother.sweep_single_flips(passes);
    return criterion.pairs ? flips + smoother.sweep_pairs_of_flips(passes) : flips;
}

}  // namespace ellicast::receiver
