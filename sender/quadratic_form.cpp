// sender/quadratic_form.cpp
#include "sender/quadratic_form.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ellicast::sender {
namespace {

using Eigen::Vector3d;

// Where slope s + bend s^2 / 2 is least in [0, 1], and its value there.
struct SegmentLeast {
    double s = 0;
    double change = 0;
};
SegmentLeast least_on_segment(double slope, double bend) {
    double s = 1.0;
    if (slope >= 0.0) {
        s = 0.0;
    } else if (bend > 0.0) {
        s = std::min(1.0, -slope / bend);
    }
    return {s, s * slope + 0.5 * s * s * bend};
}

}  // namespace

QuadraticForm::QuadraticForm(const Eigen::Matrix4d& Q)
    : xx(Q(0, 0)),
      yy(Q(1, 1)),
      zz(Q(2, 2)),
      xy(Q(0, 1) + Q(1, 0)),
      xz(Q(0, 2) + Q(2, 0)),
      yz(Q(1, 2) + Q(2, 1)),
      x(Q(0, 3) + Q(3, 0)),
      y(Q(1, 3) + Q(3, 1)),
      z(Q(2, 3) + Q(3, 2)),
      c(Q(3, 3)) {}

double QuadraticForm::rounding_slack(double extent) const {
    const double quadratic =
        std::abs(xx) + std::abs(yy) + std::abs(zz) + std::abs(xy) + std::abs(xz) + std::abs(yz);
    const double linear = std::abs(x) + std::abs(y) + std::abs(z);
    constexpr double kUnits = 32.0 * std::numeric_limits<double>::epsilon();
    return kUnits * ((quadratic * extent + linear) * extent + std::abs(c));
}

QuadraticForm combine(const QuadraticForm& F0, double t, const QuadraticForm& F1) {
    QuadraticForm F;
    F.xx = F0.xx + t * F1.xx;
    F.yy = F0.yy + t * F1.yy;
    F.zz = F0.zz + t * F1.zz;
    F.xy = F0.xy + t * F1.xy;
    F.xz = F0.xz + t * F1.xz;
    F.yz = F0.yz + t * F1.yz;
    F.x = F0.x + t * F1.x;
    F.y = F0.y + t * F1.y;
    F.z = F0.z + t * F1.z;
    F.c = F0.c + t * F1.c;
    return F;
}

std::optional<double> contact_parameter(const QuadraticForm& F0, const QuadraticForm& F1,
                                        const Vector3d& x) {
    const double f1 = F1(x);
    if (!(f1 < 0.0)) return std::nullopt;
    return std::max(0.0, -F0(x) / f1);
}

std::optional<Vector3d> least_point(const QuadraticForm& F, const Corners& triangle, double limit) {
    const Vector3d& a = triangle[0];
    const Vector3d e1 = triangle[1] - a, e2 = triangle[2] - a;
    const double F_a = F(a);
    const Vector3d g = F.gradient(a);
    const Vector3d H1 = F.curvature(e1);
    // F(a + u e1 + v e2): the gradient in (u, v) is zero where h11 u + h12 v = -g1, h12 u + h22 v =
    // -g2.
    const double g1 = g.dot(e1), g2 = g.dot(e2);
    const double h11 = H1.dot(e1), h12 = H1.dot(e2), h22 = F.curvature(e2).dot(e2);
    const double determinant = h11 * h22 - h12 * h12;
    if (determinant > 1e-12 * h11 * h22) {
        const double u = (g2 * h12 - g1 * h22) / determinant;
        const double v = (g1 * h12 - g2 * h11) / determinant;
        // Not even the triangle's plane comes low enough: the usual case.
        if (F_a + 0.5 * (g1 * u + g2 * v) > limit) return std::nullopt;
        if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) return a + u * e1 + v * e2;
    }
    // On the border.
    Vector3d best = a;
    double least = F_a;
    const auto offer = [&](const Vector3d& from, const Vector3d& e, double F_from, double slope,
                           double bend) {
        const SegmentLeast found = least_on_segment(slope, bend);
        if (F_from + found.change < least) {
            least = F_from + found.change;
            best = from + found.s * e;
        }
    };
    offer(a, e1, F_a, g1, h11);
    offer(a, e2, F_a, g2, h22);
    // From b to c the gradient starts as g + H e1.
    offer(triangle[1], e2 - e1, F_a + g1 + 0.5 * h11, g2 - g1 + h12 - h11, h22 - 2.0 * h12 + h11);
    if (least > limit) return std::nullopt;
    return best;
}

std::optional<TriangleContact> triangle_contact(const QuadraticForm& F0, const QuadraticForm& F1,
                                                const Corners& triangle, double t_max) {
    // The least of a ratio by Dinkelbach's iteration: at the t so far, go to where F0 + t F1 is
    // least on the triangle; that point's own t is smaller. Superlinear, and t never grows.
    constexpr int kSteps = 30;
    std::optional<TriangleContact> best;
    double t = t_max;
    for (int step = 0; step < kSteps; ++step) {
        const QuadraticForm F = combine(F0, t, F1);
        const std::optional<Vector3d> x = least_point(F, triangle, 0.0);
        if (!x) break;
        const std::optional<double> here = contact_parameter(F0, F1, *x);
        if (!here || !(*here < t)) break;
        t = *here;
        best = TriangleContact{*x, t};
    }
    return best;
}

}  // namespace ellicast::sender
