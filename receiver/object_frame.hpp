#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/ellipsoid.hpp"
#include "receiver/received_object.hpp"

namespace ellicast::receiver {

/// The object's frame <-> one in which the hinted box has its centre at 0 and a diagonal of 1,
/// where all tolerances live.
struct ObjectFrame {
    Eigen::Vector3d center;
    double diagonal;

    explicit ObjectFrame(const protocol::Hint& hint) {
        const Eigen::AlignedBox3d box = box_of(hint);
        center = 0.5 * (box.min() + box.max());
        diagonal = (box.max() - box.min()).norm();
    }
    [[nodiscard]] Eigen::Vector3d to_unit(const Eigen::Vector3d& x) const {
        return (x - center) / diagonal;
    }
    [[nodiscard]] Eigen::Vector3d from_unit(const Eigen::Vector3d& x) const {
        return center + diagonal * x;
    }
    /// The hinted box, in the unit frame.
    [[nodiscard]] Eigen::AlignedBox3d unit_box(const protocol::Hint& hint) const {
        const Eigen::AlignedBox3d box = box_of(hint);
        return {to_unit(box.min()), to_unit(box.max())};
    }

  private:
    static Eigen::AlignedBox3d box_of(const protocol::Hint& hint) {
        const auto& lo = hint.box_min;
        const auto& hi = hint.box_max;
        return {Eigen::Vector3d(lo[0], lo[1], lo[2]), Eigen::Vector3d(hi[0], hi[1], hi[2])};
    }
};

/// The received ellipsoids in the unit frame, in index order.
std::vector<common::Ellipsoid> unit_ellipsoids(const ReceivedObject& object,
                                               const ObjectFrame& frame);

/// What the description says to add to every position; zero without one.
Eigen::Vector3d origin_of(const ReceivedObject& object);

}  // namespace ellicast::receiver
