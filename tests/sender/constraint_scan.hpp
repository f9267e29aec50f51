// tests/sender/constraint_scan.hpp: the plain scan that the trees are held against.
#pragma once

#include <utility>

#include "sender/constraint_tree.hpp"

namespace ellicast::tests {

/// Looks at every constraint, in order, as [BK02] section 3.2 writes it for points.
class ConstraintScan final : public sender::ConstraintSearch {
  public:
    explicit ConstraintScan(sender::Constraints constraints)
        : constraints_(std::move(constraints)) {}

    [[nodiscard]] std::optional<sender::Contact> first_contact(
        const sender::QuadraticForm& F0, const sender::QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> /*guesses*/) const override {
        std::optional<sender::Contact> best;
        std::uint32_t number = 0;
        for (const Eigen::Vector3d& x : constraints_.points) {
            const std::optional<double> t = sender::contact_parameter(F0, F1, x);
            if (t && *t <= t_max && (!best || *t < best->t)) {
                best = sender::Contact{number, x, *t};
            }
            ++number;
        }
        for (const sender::Corners& triangle : constraints_.triangles) {
            const auto contact = sender::triangle_contact(F0, F1, triangle, t_max);
            if (contact && (!best || contact->t < best->t)) {
                best = sender::Contact{number, contact->point, contact->t};
            }
            ++number;
        }
        return best;
    }

  private:
    sender::Constraints constraints_;
};

}  // namespace ellicast::tests
