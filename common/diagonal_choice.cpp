// common/diagonal_choice.cpp
#include "common/diagonal_choice.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "common/fast_angle.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// Of the height term, estimated normals and tags: logistic fits over six models at 10 to 50 % loss
// gave twice as much, which harms where the surface has creases.
constexpr double kRiseWeight = 9.0;
constexpr double kTaggedRiseWeight = 18.0;

// Of marks: about what a rule's own terms come to where it fails. More than that, and pairs of
// marks that belong to different edges lead astray.
constexpr double kMarkWeight = 1.0;
constexpr double kMarkPerAngle = 1.2;

// The rules, without loss. Scans are mostly Delaunay, meshes that were decimated are not.
struct Rule {
    double angle;
    double rise;  // in units of the weights above
};
constexpr std::array<Rule, kDiagonalRules> kRules = {
    {{0.0, 1.0}, {0.4, 1.0}, {1.6, 1.0}, {6.0, 3.0}, {6.0, 1.0}, {6.0, 0.0}}};
// An edge of the original is one between survivors only if nothing near it was lost.
constexpr double kVerticesAround = 5.0;

double angle_between(const Vector3d& n1, const Vector3d& n2) {
    return angle_of(n1.dot(n2), n1.cross(n2).norm());
}

Vector3d normal_of(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    return (b - a).cross(c - a);
}

double crease_gain(const Quad& q) {
    const Vector3d abc = normal_of(q.a, q.b, q.c);
    const Vector3d bad = normal_of(q.b, q.a, q.d);
    const Vector3d cdb = normal_of(q.c, q.d, q.b);
    const Vector3d dca = normal_of(q.d, q.c, q.a);
    const double bc = (q.b - q.c).norm();
    const double ca = (q.c - q.a).norm();
    const double ad = (q.a - q.d).norm();
    const double db = (q.d - q.b).norm();
    const auto& outer = q.outer_normals;
    const double now = (q.a - q.b).norm() * (kDiagonalLengthWeight + angle_between(abc, bad)) +
                       bc * angle_between(abc, outer[0]) + ca * angle_between(abc, outer[1]) +
                       ad * angle_between(bad, outer[2]) + db * angle_between(bad, outer[3]);
    const double flipped = (q.c - q.d).norm() * (kDiagonalLengthWeight + angle_between(cdb, dca)) +
                           bc * angle_between(cdb, outer[0]) + ca * angle_between(dca, outer[1]) +
                           ad * angle_between(dca, outer[2]) + db * angle_between(cdb, outer[3]);
    return now - flipped;
}

double angle_gain(const Quad& q) {
    return angle_between(q.a - q.c, q.b - q.c) + angle_between(q.a - q.d, q.b - q.d) -
           angle_between(q.c - q.a, q.d - q.a) - angle_between(q.c - q.b, q.d - q.b);
}

// How far the surface rises above the middle of an edge, after the normals at its ends.
double rise_over(const Vector3d& p, const Vector3d& q, const Vector3d& n, const Vector3d& m) {
    return (q - p).dot(m - n) / 8.0;
}

double rise_gain(const Quad& q) {
    const Vector3d up = (normal_of(q.a, q.b, q.c) + normal_of(q.b, q.a, q.d)).normalized();
    const double z = 0.5 * (q.c + q.d - q.a - q.b).dot(up);
    const auto& n = q.vertex_normals;
    const auto nearer = [z](double surface) { return std::abs(surface) - std::abs(surface - z); };
    const double after_ab = nearer(rise_over(q.a, q.b, n[0], n[1]));
    const double after_cd = nearer(z + rise_over(q.c, q.d, n[2], n[3]));
    if (after_ab > 0.0 && after_cd > 0.0) return std::min(after_ab, after_cd);
    if (after_ab < 0.0 && after_cd < 0.0) return std::max(after_ab, after_cd);
    return 0.0;
}

}  // namespace

DiagonalGain diagonal_gain(const Quad& quad) {
    return {crease_gain(quad), angle_gain(quad), rise_gain(quad)};
}

double weighed_diagonal_gain(const Quad& quad, const DiagonalWeights& weights, double unit) {
    const DiagonalGain gain{crease_gain(quad), weights.angle != 0.0 ? angle_gain(quad) : 0.0,
                            weights.rise != 0.0 ? rise_gain(quad) : 0.0};
    return gain.weighed(weights.angle, weights.rise, unit);
}

DiagonalWeights diagonal_weights(std::uint8_t rule, bool tagged, double loss) {
    assert(rule < kDiagonalRules);
    const Rule& r = kRules[rule];
    const double kept = std::pow(1.0 - loss, kVerticesAround);
    return {kept * r.angle,
            (tagged ? kTaggedRiseWeight : kRiseWeight) * (1.0 + kept * (r.rise - 1.0)),
            tagged ? kept * (kMarkWeight + kMarkPerAngle * r.angle) : 0.0};
}

}  // namespace ellicast::common
