// sender/unit_frame.hpp
#pragma once

#include <Eigen/Core>
#include <cassert>
#include <cmath>
#include <vector>

#include "common/ellipsoid.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// The frame in which decomposition computes: the model's bounding box centred at the origin, its
/// diagonal of length 1. Tolerances are then shares of the diagonal, whatever unit and place the
/// model has.
class UnitFrame {
  public:
    /// Requires a finite box of positive diagonal (asserted).
    explicit UnitFrame(const std::vector<Eigen::Vector3d>& positions) {
        const Eigen::AlignedBox3d box = common::bounding_box(positions);
        assert(!box.isEmpty());
        center_ = 0.5 * box.min() + 0.5 * box.max();
        diagonal_ = box.diagonal().stableNorm();
        assert(diagonal_ > 0.0 && std::isfinite(diagonal_) && center_.allFinite());
    }

    [[nodiscard]] double diagonal() const { return diagonal_; }

    [[nodiscard]] common::TriangleMesh to_unit(const common::TriangleMesh& model) const {
        common::TriangleMesh unit = model;
        for (Eigen::Vector3d& p : unit.positions) p = (p - center_) / diagonal_;
        return unit;
    }
    [[nodiscard]] common::Ellipsoid to_model(const common::Ellipsoid& unit) const {
        return {center_ + diagonal_ * unit.center, diagonal_ * unit.L};
    }
    [[nodiscard]] common::Ellipsoid to_unit(const common::Ellipsoid& model) const {
        return {(model.center - center_) / diagonal_, model.L / diagonal_};
    }

  private:
    Eigen::Vector3d center_;
    double diagonal_ = 0;
};

}  // namespace ellicast::sender
