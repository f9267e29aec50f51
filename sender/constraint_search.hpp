// sender/constraint_search.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

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
};

/// A point that stops the growth of F0 + t F1, and when.
struct Contact {
    std::uint32_t point = 0;
    double t = 0;
};

/// When the point stops the growth: the t >= 0 with F0(x) + t F1(x) = 0, given F1(x) < 0; zero when
/// x lies inside from the start. Empty when F1(x) >= 0: growth moves away from x.
std::optional<double> contact_parameter(const QuadraticForm& F0, const QuadraticForm& F1,
                                        const Eigen::Vector3d& x);

/// The one question of growth ([BK02] section 3.2 for all its stages, see DESIGN section 3): which
/// constraint point is met first when F0 + t F1 grows with t? Sphere: F0 = |x - p|^2, F1 = -2 n'(x
/// - p); wedge: F0 = Q1, F1 = Q2; cylinder: F0 = Q1 + alpha Q2, F1 = Q3; inflation: F0 = d'Ad, F1 =
/// -1.
class ConstraintSearch {
  public:
    virtual ~ConstraintSearch() = default;

    /// The contact with the least t in [0, t_max], ties by the smaller index. Empty when there is
    /// none. `guesses` are points likely to be met early; they may cut the search short and change
    /// nothing in the result. Requires F0 + t F1 convex for all t in [0, t_max], t_max finite; F0
    /// >= 0 at all points with F1 < 0 (a point where it is not stops at t = 0).
    [[nodiscard]] virtual std::optional<Contact> first_contact(
        const QuadraticForm& F0, const QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> guesses) const = 0;

    [[nodiscard]] virtual const std::vector<Eigen::Vector3d>& points() const = 0;

  protected:
    ConstraintSearch() = default;
    ConstraintSearch(const ConstraintSearch&) = default;
    ConstraintSearch(ConstraintSearch&&) = default;
    ConstraintSearch& operator=(const ConstraintSearch&) = default;
    ConstraintSearch& operator=(ConstraintSearch&&) = default;
};

}  // namespace ellicast::sender
