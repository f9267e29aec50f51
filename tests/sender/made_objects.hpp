// tests/sender/made_objects.hpp: models and objects made of numbers, for tests that need no real
// shape.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/random.hpp"
#include "sender/broadcast_object.hpp"

namespace ellicast::tests {

/// Uniform on the unit sphere, in no particular order.
inline std::vector<Eigen::Vector3d> sphere_points(std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t k = 0; k < count; ++k) {
        const double z = 2.0 * random.uniform() - 1.0;
        const double angle = 2.0 * std::numbers::pi * random.uniform();
        const double r = std::sqrt(1.0 - z * z);
        points.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
    return points;
}

/// 0, 1, ... along x: the rank along any curve is x itself. Two corners give the box a height.
inline std::vector<Eigen::Vector3d> line_points(std::size_t count) {
    std::vector<Eigen::Vector3d> points;
    for (std::size_t k = 0; k < count; ++k) points.emplace_back(static_cast<double>(k), 0.0, 0.0);
    return points;
}

inline sender::PreparedModel model_of(std::vector<Eigen::Vector3d> vertices) {
    sender::PreparedModel model;
    model.vertices = std::move(vertices);
    model.solid.positions = model.vertices;
    return model;
}

/// Balls at seeded places in the box of the points, a tenth of its diagonal thick.
inline sender::Decomposition balls_in(const std::vector<Eigen::Vector3d>& points, std::size_t count,
                                      std::uint64_t seed) {
    const Eigen::AlignedBox3d box = common::bounding_box(points);
    const double size = points.size() > 1 ? box.diagonal().norm() : 1.0;
    common::Random random(seed);
    sender::Decomposition decomposition;
    for (std::size_t k = 0; k < count; ++k) {
        common::Ellipsoid ball;
        for (int axis = 0; axis < 3; ++axis) {
            ball.center[axis] = box.min()[axis] + random.uniform() * box.sizes()[axis];
        }
        ball.L = Eigen::Matrix3d::Identity() * (0.05 * size * (0.5 + random.uniform()));
        decomposition.ellipsoids.push_back(ball);
    }
    return decomposition;
}

/// An object of that many ellipsoids and vertices (two at least).
inline sender::BroadcastObject made_object(std::size_t ellipsoids, std::size_t vertices,
                                           std::uint64_t seed = 1) {
    const std::vector<Eigen::Vector3d> points = sphere_points(vertices, seed);
    return sender::make_object(model_of(points), sender::ShapePromise{},
                               balls_in(points, ellipsoids, seed), {"made", seed});
}

}  // namespace ellicast::tests
