#include "receiver/object_frame.hpp"

namespace ellicast::receiver {

std::vector<common::Ellipsoid> unit_ellipsoids(const ReceivedObject& object,
                                               const ObjectFrame& frame) {
    std::vector<common::Ellipsoid> result;
    result.reserve(object.ellipsoids.size());
    for (const protocol::EllipsoidRecord& record : object.ellipsoids) {
        const auto& s = record.scalars;
        common::Ellipsoid e;
        e.center = frame.to_unit({s[0], s[1], s[2]});
        e.L << s[3], 0, 0, s[4], s[5], 0, s[6], s[7], s[8];
        e.L /= frame.diagonal;
        result.push_back(e);
    }
    return result;
}

Eigen::Vector3d origin_of(const ReceivedObject& object) {
    if (!object.description) return Eigen::Vector3d::Zero();
    return Eigen::Map<const Eigen::Vector3d>(object.description->origin.data());
}

}  // namespace ellicast::receiver
