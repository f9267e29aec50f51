// sender/quadratic_form.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace ellicast::sender {

/// The polynomial [x;1]' Q [x;1] of a symmetric 4x4 matrix, multiplied out: nine products an
/// evaluation.
struct QuadraticForm {
    double xx = 0, yy = 0, zz = 0;  // Q_ii
    double xy = 0, xz = 0, yz = 0;  // 2 Q_ij
    double x = 0, y = 0, z = 0;     // 2 Q_i4
    double c = 0;                   // Q_44

    QuadraticForm() = default;
    explicit QuadraticForm(const Eigen::Matrix4d& Q);

    [[nodiscard]] double operator()(double px, double py, double pz) const {
        return px * (xx * px + xy * py + xz * pz + x) + py * (yy * py + yz * pz + y) +
               pz * (zz * pz + z) + c;
    }
    [[nodiscard]] double operator()(const Eigen::Vector3d& p) const {
        return (*this)(p[0], p[1], p[2]);
    }

    [[nodiscard]] Eigen::Vector3d gradient(const Eigen::Vector3d& p) const {
        return curvature(p) + Eigen::Vector3d(x, y, z);
    }

    /// The Hessian times d.
    [[nodiscard]] Eigen::Vector3d curvature(const Eigen::Vector3d& d) const {
        return {2.0 * xx * d[0] + xy * d[1] + xz * d[2], xy * d[0] + 2.0 * yy * d[1] + yz * d[2],
                xz * d[0] + yz * d[1] + 2.0 * zz * d[2]};
    }

    /// Bound on the rounding error of an evaluation at coordinates of at most `extent`: some units
    /// in the last place of the sum of the terms' magnitudes.
    [[nodiscard]] double rounding_slack(double extent) const;
};

/// F0 + t F1.
QuadraticForm combine(const QuadraticForm& F0, double t, const QuadraticForm& F1);

/// When a point stops the growth of F0 + t F1: the t >= 0 with F0(x) + t F1(x) = 0, given F1(x) <
/// 0; zero when x lies inside from the start. Empty when F1(x) >= 0: growth moves away from x.
/// [BK02] eq. (2).
std::optional<double> contact_parameter(const QuadraticForm& F0, const QuadraticForm& F1,
                                        const Eigen::Vector3d& x);

using Corners = std::array<Eigen::Vector3d, 3>;

/// Where F is least on the triangle; empty when that is above `limit`. Requires F convex.
/// Degenerate triangles are the segment or point that they are.
std::optional<Eigen::Vector3d> least_point(const QuadraticForm& F, const Corners& triangle,
                                           double limit);

/// Where and when a triangle stops the growth of F0 + t F1 within [0, t_max]: the least contact
/// parameter of all its points. Empty when it does not. Requires F0 + t F1 convex for all t in [0,
/// t_max] and F0 >= 0 on the triangle where F1 < 0.
struct TriangleContact {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    double t = 0;
};
std::optional<TriangleContact> triangle_contact(const QuadraticForm& F0, const QuadraticForm& F1,
                                                const Corners& triangle, double t_max);

}  // namespace ellicast::sender
