// receiver/flip_gains.cpp
#include "receiver/flip_gains.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/diagonal_choice.hpp"
#include "common/parallel.hpp"
#include "receiver/float_lanes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Triangle quality below which a smoothing flip may not go, unless it was lower before.
constexpr float kThinnest = 0.02F;

// Angle between the positive x axis and (x, y), y >= 0: minimax polynomial of the arc tangent over
// [0, 1], off by at most 3e-7. A third of the time of std::atan2, and the same bits everywhere.
float angle_of(float x, float y) {
    const float magnitude = std::abs(x);
    const float larger = std::max(magnitude, y);
    if (!(larger > 0.0F)) return 0.0F;
    const float t = std::min(magnitude, y) / larger;
    const float q = t * t;
    const float low = t * (0.9999961116F + q * (-0.3331736806F + q * 0.1980781557F));
    const float high =
        -0.1323334207F + q * (0.0796236715F + q * (-0.03360421956F + q * 0.006811792907F));
    const float acute = low + t * q * q * q * high;
    const float right = y > magnitude ? 0.5F * std::numbers::pi_v<float> - acute : acute;
    return x < 0.0F ? std::numbers::pi_v<float> - right : right;
}

float angle_between(const Vector3f& n, const Vector3f& m) {
    return angle_of(n.dot(m), n.cross(m).norm());
}

// In mean edge lengths, more than what sums of doubles lose when their order changes.
constexpr double kBoundRounding = 1e-9;

// Corners of an edge's two triangles, a b c and b a d, relative to a: what is subtracted in double
// is small and exact enough in float.
struct Corners {
    Vector3f b, c, d;
};

float quality(float twice_area, float sum_of_squares) {
    if (!(sum_of_squares > 0.0F)) return 0.0F;
    return 2.0F * std::numbers::sqrt3_v<float> * twice_area / sum_of_squares;
}

// The flip leaves a needle.
bool too_thin(const Corners& q, const QuadCosts& now, const QuadCosts& flipped) {
    const float ab = q.b.squaredNorm();
    const float bc = (q.c - q.b).squaredNorm();
    const float ca = q.c.squaredNorm();
    const float ad = q.d.squaredNorm();
    const float db = (q.b - q.d).squaredNorm();
    const float cd = (q.d - q.c).squaredNorm();
    const float after = std::min(quality(flipped.normals[0].norm(), cd + db + bc),
                                 quality(flipped.normals[1].norm(), cd + ca + ad));
    if (after >= kThinnest) return false;
    return after < std::min(quality(now.normals[0].norm(), ab + bc + ca),
                            quality(now.normals[1].norm(), ab + ad + db));
}

// DiagonalGain::angle.
float angle_gain(const Corners& q) {
    const Vector3f bc = q.b - q.c;
    const Vector3f bd = q.b - q.d;
    const Lanes angles =
        angle_between(Lanes3::of(-q.c, -q.d, q.c, -bc), Lanes3::of(bc, bd, q.d, -bd));
    return angles[0] + angles[1] - angles[2] - angles[3];
}

// How far the surface rises above the middle of an edge, after the normals at its ends.
float rise_over(const Vector3f& edge, const Vector3d& n, const Vector3d& m) {
    return edge.dot((m - n).cast<float>()) / 8.0F;
}

// DiagonalGain::rise.
float rise_gain(const Corners& q, const QuadCosts& now, const std::array<const Vector3d*, 4>& n) {
    const Vector3f up = (now.normals[0] + now.normals[1]).normalized();
    const float z = 0.5F * (q.c + q.d - q.b).dot(up);
    const auto nearer = [z](float surface) { return std::abs(surface) - std::abs(surface - z); };
    const float after_ab = nearer(rise_over(q.b, *n[0], *n[1]));
    const float after_cd = nearer(z + rise_over(q.d - q.c, *n[2], *n[3]));
    if (after_ab > 0.0F && after_cd > 0.0F) return std::min(after_ab, after_cd);
    if (after_ab < 0.0F && after_cd < 0.0F) return std::max(after_ab, after_cd);
    return 0.0F;
}

// No rise is more than the height of cd's middle over ab's, and some more for rounding.
double most_rise_gain(const Corners& q) {
    constexpr float kMore = 0.5F * 1.0001F;
    return static_cast<double>(kMore * (q.c + q.d - q.b).norm());
}

// In mean edge lengths: what the sender's marks say for cd, less what they say for ab.
double mark_gain(const std::array<VertexId, 4>& id, const FlipCriterion& criterion) {
    if (criterion.marks.empty()) return 0.0;
    const auto marked = [&](std::size_t i, std::size_t j) {
        return criterion.marks[id[i]] != 0 && criterion.marks[id[j]] != 0 ? 1 : 0;
    };
    return criterion.weights.mark * (marked(2, 3) - marked(0, 1));
}

}  // namespace

FlipGains::FlipGains(SurfaceMesh& mesh, const FlipCriterion& criterion)
    : mesh_(mesh),
      criterion_(criterion),
      unit_(mean_edge_length(mesh)),
      normals_(mesh.face_slots()),
      creases_(3 * mesh.face_slots(), 0.0F) {
    const auto in_parallel = [&](std::size_t count, const auto& body) {
        common::parallel_for(count, criterion.threads, [&](std::size_t begin, std::size_t end) {
            for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) body(i);
        });
    };
    in_parallel(mesh.face_slots(), [&](FaceId f) {
        if (mesh.face_alive(f)) normals_[f] = mesh.area_normal(f).cast<float>();
    });
    in_parallel(creases_.size(), [&](HalfedgeId h) {
        const FaceId f = SurfaceMesh::face_of(h);
        if (!mesh.face_alive(f) || h > mesh.twin(h)) return;
        const Vector3d edge = mesh.position(mesh.to_vertex(h)) - mesh.position(mesh.from_vertex(h));
        set_crease(h, edge.cast<float>().norm() * angle_between(normals_[f], normal_beyond(h)));
    });
}

bool FlipGains::settled(const FlipRegion& region) const {
    if (criterion_.fixed != nullptr &&
        criterion_.fixed->contains(region.corners[0], region.corners[1])) {
        return true;
    }
    if (criterion_.settled.empty()) return false;
    return std::any_of(region.corners.begin(), region.corners.end(),
                       [&](VertexId v) { return criterion_.settled[v] != 0; });
}

FlipRegion FlipGains::region_of(HalfedgeId h) const {
    const HalfedgeId t = mesh_.twin(h);
    const std::array<HalfedgeId, 4> sides = {SurfaceMesh::next(h), SurfaceMesh::prev(h),
                                             SurfaceMesh::next(t), SurfaceMesh::prev(t)};
    return {{mesh_.from_vertex(h), mesh_.to_vertex(h), mesh_.opposite(h), mesh_.opposite(t)},
            {{normals_[SurfaceMesh::face_of(h)], normals_[SurfaceMesh::face_of(t)]},
             {creases_[h], creases_[sides[0]], creases_[sides[1]], creases_[sides[2]],
              creases_[sides[3]]}},
            {normal_beyond(sides[0]), normal_beyond(sides[1]), normal_beyond(sides[2]),
             normal_beyond(sides[3])}};
}

// Of an edge around h once h is flipped: d -> b, b -> c, c -> a or a -> d, as in QuadCosts. No face
// beyond has two of them, or c and d were joined already and h could not be flipped.
FlipRegion FlipGains::region_after(HalfedgeId h, const Trial& first, unsigned side) const {
    const HalfedgeId t = mesh_.twin(h);
    const std::array<HalfedgeId, 4> sides = {SurfaceMesh::prev(t), SurfaceMesh::next(h),
                                             SurfaceMesh::prev(h), SurfaceMesh::next(t)};
    const auto& [normals, creases] = first.flipped;
    const unsigned face = side / 2;  // (c, d, b) or (d, c, a); its third edge is cd
    const unsigned other = side ^ 1U;
    const HalfedgeId s = sides[side];
    const HalfedgeId y = mesh_.twin(s);
    const VertexId third =
        side % 2 == 0 ? mesh_.to_vertex(sides[other]) : mesh_.from_vertex(sides[other]);
    FlipRegion region{{mesh_.from_vertex(s), mesh_.to_vertex(s), third, mesh_.opposite(y)},
                      {{normals[face], normals_[SurfaceMesh::face_of(y)]},
                       {creases[side + 1], creases[other + 1], creases[0],
                        creases_[SurfaceMesh::next(y)], creases_[SurfaceMesh::prev(y)]}},
                      {normal_beyond(sides[other]), normals[1 - face],
                       normal_beyond(SurfaceMesh::next(y)), normal_beyond(SurfaceMesh::prev(y))}};
    if (side % 2 != 0) {
        std::swap(region.now.creases[1], region.now.creases[2]);
        std::swap(region.beyond[0], region.beyond[1]);
    }
    return region;
}

FlipGains::Trial FlipGains::consider(HalfedgeId h, double needed) const {
    return judge(region_of(h), needed);
}

double FlipGains::best_pair_gain(HalfedgeId h, const Trial& first, double needed) const {
    double best = -std::numeric_limits<double>::infinity();
    const double second = needed - first.gain - kBoundRounding * unit_;
    for (unsigned side = 0; side < 4; ++side) {
        best = std::max(best, judge(region_after(h, first, side), second).gain);
    }
    return first.gain + best;
}

// The terms are taken by price, and the rest let be once it cannot make up for what they lack:
// what a new crease costs is never less than 0.
FlipGains::Trial FlipGains::judge(const FlipRegion& region, double needed) const {
    Trial trial;
    trial.gain = -std::numeric_limits<double>::infinity();
    if (settled(region)) return trial;
    const auto& id = region.corners;
    const Vector3d& a = mesh_.position(id[0]);
    const Corners q{(mesh_.position(id[1]) - a).cast<float>(),
                    (mesh_.position(id[2]) - a).cast<float>(),
                    (mesh_.position(id[3]) - a).cast<float>()};
    const Vector3f along_cd = q.d - q.c;
    const float cd = along_cd.norm();
    float gain = static_cast<float>(common::kDiagonalLengthWeight) * (q.b.norm() - cd);
    for (const float crease : region.now.creases) gain += crease;
    const bool rises = !criterion_.normals.empty() && criterion_.weights.rise != 0.0;
    const double marks = mark_gain(id, criterion_) * unit_;
    const double angles = criterion_.weights.angle != 0.0 ? criterion_.weights.angle * unit_ *
                                                                static_cast<double>(angle_gain(q))
                                                          : 0.0;
    double hope = marks + angles + kBoundRounding * unit_;
    if (rises) hope += criterion_.weights.rise * most_rise_gain(q);
    if (!(static_cast<double>(gain) + hope > needed)) return trial;

    QuadCosts& flipped = trial.flipped;
    // (c, d, b) and (d, c, a); then next(h) is d -> b, prev(h) b -> c, next(t) c -> a, prev(t) a ->
    // d.
    flipped.normals = {along_cd.cross(q.b - q.c), q.d.cross(q.c)};
    const auto& [cdb, dca] = flipped.normals;
    flipped.creases[0] = cd * angle_between(cdb, dca);
    gain -= flipped.creases[0];
    if (!(static_cast<double>(gain) + hope > needed)) return trial;

    const auto& [bc, ca, ad, db] = region.beyond;
    const Lanes creases = norm(Lanes3::of(q.b - q.d, q.c - q.b, q.c, q.d)) *
                          angle_between(Lanes3::of(cdb, cdb, dca, dca), Lanes3::of(db, bc, ca, ad));
    for (std::size_t k = 0; k < 4; ++k) {
        flipped.creases[k + 1] = creases[k];
        gain -= creases[k];
    }
    if (!(static_cast<double>(gain) + hope > needed)) return trial;

    if (too_thin(q, region.now, flipped)) return trial;
    trial.now = region.now;
    trial.gain = static_cast<double>(gain) + marks;
    if (criterion_.weights.angle != 0.0) trial.gain += angles;
    if (rises) {
        const auto& n = criterion_.normals;
        trial.gain += criterion_.weights.rise *
                      static_cast<double>(
                          rise_gain(q, region.now, {&n[id[0]], &n[id[1]], &n[id[2]], &n[id[3]]}));
    }
    return trial;
}

void FlipGains::set_crease(HalfedgeId h, float crease) {
    creases_[h] = creases_[mesh_.twin(h)] = crease;
}

void FlipGains::set(HalfedgeId h, const QuadCosts& costs) {
    const HalfedgeId t = mesh_.twin(h);
    normals_[SurfaceMesh::face_of(h)] = costs.normals[0];
    normals_[SurfaceMesh::face_of(t)] = costs.normals[1];
    set_crease(h, costs.creases[0]);
    set_crease(SurfaceMesh::next(h), costs.creases[1]);
    set_crease(SurfaceMesh::prev(h), costs.creases[2]);
    set_crease(SurfaceMesh::next(t), costs.creases[3]);
    set_crease(SurfaceMesh::prev(t), costs.creases[4]);
}

void FlipGains::flip(HalfedgeId h, const Trial& trial) {
    mesh_.flip(h);
    set(h, trial.flipped);
}

void FlipGains::undo(HalfedgeId h, const Trial& trial) {
    mesh_.flip(h);
    // Two flips leave the edge turned round: h is now b -> a, and the faces have changed places.
    const auto& n = trial.now.normals;
    const auto& [ab, bc, ca, ad, db] = trial.now.creases;
    set(h, {{n[1], n[0]}, {ab, ad, db, bc, ca}});
}

}  // namespace ellicast::receiver
