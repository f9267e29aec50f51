// common/triangle_point.cpp
#include "common/triangle_point.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// Squared sine of the angle at corner a below which barycentric coordinates lose so many digits
// (the rounding error grows as 1/sine) that all edges are tried as well.
constexpr double kThinSine2 = 1e-6;

bool lexicographically_less(const Vector3d& p, const Vector3d& q) {
    if (p[0] != q[0]) return p[0] < q[0];
    if (p[1] != q[1]) return p[1] < q[1];
    return p[2] < q[2];
}

struct SegmentPoint {
    Vector3d point;
    double t = 0;  // share of the second end point
};

// Closest point of segment pq to x. The end points are put in one order first, so that both
// triangles of an edge find the same bits, and the tie between them is a tie.
SegmentPoint closest_point_on_segment(const Vector3d& x, const Vector3d& p, const Vector3d& q) {
    const bool swapped = lexicographically_less(q, p);
    const Vector3d& from = swapped ? q : p;
    const Vector3d& to = swapped ? p : q;
    const Vector3d d = to - from;
    const double along = (x - from).dot(d);
    const double length2 = d.squaredNorm();
    SegmentPoint result;
    if (!(along > 0.0)) {
        result.point = from;
        result.t = 0.0;
    } else if (along >= length2) {
        result.point = to;
        result.t = 1.0;
    } else {
        result.t = along / length2;
        result.point = from + result.t * d;
    }
    if (swapped) result.t = 1.0 - result.t;
    return result;
}

}  // namespace

TrianglePoint closest_point_on_triangle(const Vector3d& x, const Vector3d& a, const Vector3d& b,
                                        const Vector3d& c) {
    const Vector3d ab = b - a;
    const Vector3d ac = c - a;
    const Vector3d ax = x - a;
    const Vector3d n = ab.cross(ac);
    const double n2 = n.squaredNorm();
    // Barycentric coordinates of the projection of x, times n2.
    const double v = ax.cross(ac).dot(n);
    const double w = ab.cross(ax).dot(n);
    const double u = n2 - v - w;
    const bool thin = !(n2 > kThinSine2 * ab.squaredNorm() * ac.squaredNorm());
    const bool inside = n2 > 0.0 && u >= 0.0 && v >= 0.0 && w >= 0.0;

    TrianglePoint best;
    double best2 = std::numeric_limits<double>::infinity();
    if (inside) {
        const double v1 = v / n2;
        const double w1 = w / n2;
        best.point = a + v1 * ab + w1 * ac;
        best.barycentric = {std::max(0.0, 1.0 - v1 - w1), v1, w1};
        // Rounding must not carry the point out of the triangle's box: the tree relies on it.
        best.point =
            best.point.cwiseMax(a.cwiseMin(b).cwiseMin(c)).cwiseMin(a.cwiseMax(b).cwiseMax(c));
        if (!thin) return best;
        best2 = (x - best.point).squaredNorm();
    }
    // Outside, the closest point lies on an edge that x is beyond. Thin triangles try all edges.
    const auto try_edge = [&](const Vector3d& p, const Vector3d& q, int i, int j) {
        const SegmentPoint s = closest_point_on_segment(x, p, q);
        const Vector3d clamped = s.point.cwiseMax(p.cwiseMin(q)).cwiseMin(p.cwiseMax(q));
        const double d2 = (x - clamped).squaredNorm();
        if (!(d2 < best2)) return;
        best2 = d2;
        best.point = clamped;
        best.barycentric.setZero();
        best.barycentric[i] = 1.0 - s.t;
        best.barycentric[j] = s.t;
    };
    if (thin || w < 0.0) try_edge(a, b, 0, 1);
    if (thin || u < 0.0) try_edge(b, c, 1, 2);
    if (thin || v < 0.0) try_edge(c, a, 2, 0);
    return best;
}

}  // namespace ellicast::common
