// tests/sender/constraint_scan.hpp: the plain scan that the tree is held against.
#pragma once

#include <utility>
#include <vector>

#include "sender/constraint_search.hpp"

namespace ellicast::tests {

/// Looks at every point, in order, as [BK02] section 3.2 writes it.
class ConstraintScan final : public sender::ConstraintSearch {
  public:
    explicit ConstraintScan(std::vector<Eigen::Vector3d> points) : points_(std::move(points)) {}

    [[nodiscard]] std::optional<sender::Contact> first_contact(
        const sender::QuadraticForm& F0, const sender::QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> /*guesses*/) const override {
        std::optional<sender::Contact> best;
        for (std::uint32_t i = 0; i < points_.size(); ++i) {
            const std::optional<double> t = sender::contact_parameter(F0, F1, points_[i]);
            if (t && *t <= t_max && (!best || *t < best->t)) best = sender::Contact{i, *t};
        }
        return best;
    }

    [[nodiscard]] const std::vector<Eigen::Vector3d>& points() const override { return points_; }

  private:
    std::vector<Eigen::Vector3d> points_;
};

}  // namespace ellicast::tests
