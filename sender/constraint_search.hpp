// sender/constraint_search.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>

#include "sender/quadratic_form.hpp"

namespace ellicast::sender {

/// What stops the growth of F0 + t F1, where and when.
struct Contact {
    std::uint32_t constraint = 0;  // which point or triangle
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    double t = 0;
};

/// The one question of growth ([BK02] section 3.2 for all its stages, see DESIGN section 3): which
/// constraint is met first when F0 + t F1 grows with t? Sphere: F0 = |x - p|^2, F1 = -2 n'(x - p);
/// wedge: F0 = Q1, F1 = Q2; cylinder: F0 = Q1 + alpha Q2, F1 = Q3; inflation: F0 = d'Ad, F1 = -1.
class ConstraintSearch {
  public:
    virtual ~ConstraintSearch() = default;

    /// The contact with the least t in [0, t_max], ties by the smaller number of the constraint.
    /// Empty when there is none. `guesses` are constraints likely to be met early; they may cut the
    /// search short and change nothing in the result. Requires F0 + t F1 convex for all t in [0,
    /// t_max], t_max finite; F0 >= 0 on all constraints where F1 < 0 (a point where it is not stops
    /// at t = 0).
    [[nodiscard]] virtual std::optional<Contact> first_contact(
        const QuadraticForm& F0, const QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> guesses) const = 0;

  protected:
    ConstraintSearch() = default;
    ConstraintSearch(const ConstraintSearch&) = default;
    ConstraintSearch(ConstraintSearch&&) = default;
    ConstraintSearch& operator=(const ConstraintSearch&) = default;
    ConstraintSearch& operator=(ConstraintSearch&&) = default;
};

}  // namespace ellicast::sender
