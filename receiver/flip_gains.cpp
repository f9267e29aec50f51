// receiver/flip_gains.cpp
#include "receiver/flip_gains.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/diagonal_choice.hpp"
#include "common/fast_angle.hpp"
#include "common/parallel.hpp"
#include "receiver/float_lanes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Triangle quality below which a smoothing flip may not go, unless it was lower before.
constexpr float kThinnest = 0.02F;

float angle_between(const Vector3f& n, const Vector3f& m) {
    return common::angle_of(n.dot(m), n.cross(m).norm());
}

// In mean edge lengths, more than what sums of doubles lose when their order changes.
constexpr double kBoundRounding = 1e-9;

// Corners of an edge's two triangles, a b c and b a d, relative to a: what is subtracted in double
// is small and exact enough in float.
struct QuadCorners {
    Vector3f b, c, d;
};

float quality(float twice_area, float sum_of_squares) {
    if (!(sum_of_squares > 0.0F)) return 0.0F;
    return 2.0F * std::numbers::sqrt3_v<float> * twice_area / sum_of_squares;
}

// The flip leaves a needle.
bool too_thin(const QuadCorners& q, const std::array<Vector3f, 2>& now, const QuadCosts& flipped) {
    const float ab = q.b.squaredNorm();
    const float bc = (q.c - q.b).squaredNorm();
    const float ca = q.c.squaredNorm();
    const float ad = q.d.squaredNorm();
    const float db = (q.b - q.d).squaredNorm();
    const float cd = (q.d - q.c).squaredNorm();
    const float after = std::min(quality(flipped.normals[0].norm(), cd + db + bc),
                                 quality(flipped.normals[1].norm(), cd + ca + ad));
    if (after >= kThinnest) return false;
    return after <
           std::min(quality(now[0].norm(), ab + bc + ca), quality(now[1].norm(), ab + ad + db));
}

// DiagonalGain::angle.
float angle_gain(const QuadCorners& q) {
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
float rise_gain(const QuadCorners& q, const std::array<Vector3f, 2>& now,
                const std::array<const Vector3d*, 4>& n) {
    const Vector3f up = (now[0] + now[1]).normalized();
    const float z = 0.5F * (q.c + q.d - q.b).dot(up);
    const auto nearer = [z](float surface) { return std::abs(surface) - std::abs(surface - z); };
    const float after_ab = nearer(rise_over(q.b, *n[0], *n[1]));
    const float after_cd = nearer(z + rise_over(q.d - q.c, *n[2], *n[3]));
    if (after_ab > 0.0F && after_cd > 0.0F) return std::min(after_ab, after_cd);
    if (after_ab < 0.0F && after_cd < 0.0F) return std::max(after_ab, after_cd);
    return 0.0F;
}

// No rise is more than the height of cd's middle over ab's, and some more for rounding.
double most_rise_gain(const QuadCorners& q) {
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

FlipGains::FlipGains(SurfaceMesh& mesh, unsigned threads)
    : mesh_(mesh),
      unit_(mean_edge_length(mesh, threads)),
      normals_(mesh.face_slots()),
      creases_(3 * mesh.face_slots(), 0.0F) {
    const auto in_parallel = [&](std::size_t count, const auto& body) {
        common::parallel_for(count, threads, [&](std::size_t begin, std::size_t end) {
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

bool FlipGains::settled(const Corners& corners) const {
    if (criterion_.fixed != nullptr && criterion_.fixed->contains(corners[0], corners[1])) {
        return true;
    }
    if (criterion_.settled.empty()) return false;
    return std::any_of(corners.begin(), corners.end(),
                       [&](VertexId v) { return criterion_.settled[v] != 0; });
}

// The terms are taken by price, and the rest let be once it cannot make up for what they lack:
// what a new crease costs is never less than 0.
template <class AskNormals>
FlipGains::Trial FlipGains::judge(const Corners& id, const std::array<float, 5>& creases,
                                  double needed, const AskNormals& ask_normals) const {
    Trial trial;
    trial.gain = -std::numeric_limits<double>::infinity();
    if (settled(id)) return trial;
    const Vector3d& a = mesh_.position(id[0]);
    const QuadCorners q{(mesh_.position(id[1]) - a).cast<float>(),
                        (mesh_.position(id[2]) - a).cast<float>(),
                        (mesh_.position(id[3]) - a).cast<float>()};
    const Vector3f along_cd = q.d - q.c;
    const float cd = along_cd.norm();
    float gain = static_cast<float>(common::kDiagonalLengthWeight) * (q.b.norm() - cd);
    for (const float crease : creases) gain += crease;
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

    const Normals normals = ask_normals();
    const auto& [bc, ca, ad, db] = normals.beyond;
    const Lanes beyond = norm(Lanes3::of(q.b - q.d, q.c - q.b, q.c, q.d)) *
                         angle_between(Lanes3::of(cdb, cdb, dca, dca), Lanes3::of(db, bc, ca, ad));
    for (std::size_t k = 0; k < 4; ++k) {
        flipped.creases[k + 1] = beyond[k];
        gain -= beyond[k];
    }
    if (!(static_cast<double>(gain) + hope > needed)) return trial;

    if (too_thin(q, normals.now, flipped)) return trial;
    trial.now = {normals.now, creases};
    trial.gain = static_cast<double>(gain) + marks;
    if (criterion_.weights.angle != 0.0) trial.gain += angles;
    if (rises) {
        const auto& n = criterion_.normals;
        trial.gain += criterion_.weights.rise *
                      static_cast<double>(
                          rise_gain(q, normals.now, {&n[id[0]], &n[id[1]], &n[id[2]], &n[id[3]]}));
    }
    return trial;
}

FlipGains::Trial FlipGains::consider(HalfedgeId h, double needed) const {
    const HalfedgeId t = mesh_.twin(h);
    const std::array<HalfedgeId, 4> sides = {SurfaceMesh::next(h), SurfaceMesh::prev(h),
                                             SurfaceMesh::next(t), SurfaceMesh::prev(t)};
    return judge({mesh_.from_vertex(h), mesh_.to_vertex(h), mesh_.opposite(h), mesh_.opposite(t)},
                 {creases_[h], creases_[sides[0]], creases_[sides[1]], creases_[sides[2]],
                  creases_[sides[3]]},
                 needed, [&] {
                     return Normals{
                         {normals_[SurfaceMesh::face_of(h)], normals_[SurfaceMesh::face_of(t)]},
                         {normal_beyond(sides[0]), normal_beyond(sides[1]), normal_beyond(sides[2]),
                          normal_beyond(sides[3])}};
                 });
}

// Of an edge around h once h is flipped: d -> b, b -> c, c -> a or a -> d, as in QuadCosts. No face
// beyond has two of them, or c and d were joined already and h could not be flipped.
FlipGains::Trial FlipGains::judge_after(HalfedgeId h, const Trial& first, unsigned side,
                                        double needed) const {
    const HalfedgeId t = mesh_.twin(h);
    const std::array<HalfedgeId, 4> sides = {SurfaceMesh::prev(t), SurfaceMesh::next(h),
                                             SurfaceMesh::prev(h), SurfaceMesh::next(t)};
    const auto& [normals, creases] = first.flipped;
    const unsigned face = side / 2;  // (c, d, b) or (d, c, a); its third edge is cd
    const unsigned other = side ^ 1U;
    const bool turned = side % 2 != 0;
    const HalfedgeId s = sides[side];
    const HalfedgeId y = mesh_.twin(s);
    const VertexId third = turned ? mesh_.from_vertex(sides[other]) : mesh_.to_vertex(sides[other]);
    const float beside = creases[other + 1];
    return judge({mesh_.from_vertex(s), mesh_.to_vertex(s), third, mesh_.opposite(y)},
                 {creases[side + 1], turned ? creases[0] : beside, turned ? beside : creases[0],
                  creases_[SurfaceMesh::next(y)], creases_[SurfaceMesh::prev(y)]},
                 needed, [&, &kept = normals] {
                     const Eigen::Vector3f& outside = normal_beyond(sides[other]);
                     const Eigen::Vector3f& inside = kept[1 - face];
                     return Normals{{kept[face], normals_[SurfaceMesh::face_of(y)]},
                                    {turned ? inside : outside, turned ? outside : inside,
                                     normal_beyond(SurfaceMesh::next(y)),
                                     normal_beyond(SurfaceMesh::prev(y))}};
                 });
}

double FlipGains::best_pair_gain(HalfedgeId h, const Trial& first, double needed) const {
    double best = -std::numeric_limits<double>::infinity();
    const double second = needed - first.gain - kBoundRounding * unit_;
    for (unsigned side = 0; side < 4; ++side) {
        best = std::max(best, judge_after(h, first, side, second).gain);
    }
    return first.gain + best;
}

void FlipGains::set_crease(HalfedgeId h, float crease) {
    const HalfedgeId t = mesh_.twin(h);
    creases_[h] = creases_[t] = crease;
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
