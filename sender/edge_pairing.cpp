// sender/edge_pairing.cpp
#include "sender/edge_pairing.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace ellicast::sender {
namespace {

using Eigen::Vector3d;

struct Leaf {
    double turn;       // about the edge from the first triangle, in [0, 4)
    bool solid_ahead;  // in the direction of growing turn
    HalfEdge half_edge;
};

// Grows with the angle of (x, y) from 0 to 4, without trigonometry and thus the same on every
// machine.
double turn_of(double x, double y) {
    const double sum = std::abs(x) + std::abs(y);
    if (!(sum > 0.0)) return 0.0;
    const double share = y / sum;
    if (x < 0.0) return 2.0 - share;
    return y < 0.0 ? 4.0 + share : share;
}

}  // namespace

std::vector<std::pair<HalfEdge, HalfEdge>> pair_around_edge(
    const std::vector<Vector3d>& positions, const std::vector<common::Triangle>& triangles,
    std::span<const HalfEdge> edge) {
    const std::uint32_t from = std::min(origin(triangles, edge[0]), target(triangles, edge[0]));
    const std::uint32_t to = std::max(origin(triangles, edge[0]), target(triangles, edge[0]));
    const Vector3d axis = (positions[to] - positions[from]).normalized();
    const auto arm = [&](HalfEdge h) -> Vector3d {
        const HalfEdge apex = next_in_triangle(next_in_triangle(h));
        const Vector3d d = positions[origin(triangles, apex)] - positions[from];
        return d - d.dot(axis) * axis;
    };
    Vector3d e1 = arm(edge[0]).normalized();
    if (!(e1.squaredNorm() > 0.5)) e1 = axis.unitOrthogonal();  // a triangle without area
    const Vector3d e2 = axis.cross(e1);

    // A triangle that runs along the axis has its normal, and the void, ahead.
    std::vector<Leaf> leaves;
    for (const HalfEdge h : edge) {
        const Vector3d d = arm(h);
        leaves.push_back({turn_of(d.dot(e1), d.dot(e2)), origin(triangles, h) != from, h});
    }
    std::sort(leaves.begin(), leaves.end(), [](const Leaf& a, const Leaf& b) {
        return std::tie(a.turn, a.solid_ahead, a.half_edge) <
               std::tie(b.turn, b.solid_ahead, b.half_edge);
    });

    // Matching brackets on a circle: two rounds.
    std::vector<std::pair<HalfEdge, HalfEdge>> pairs;
    std::vector<HalfEdge> open;
    std::vector<bool> closed(leaves.size());
    for (std::size_t k = 0; k < 2 * leaves.size(); ++k) {
        const std::size_t i = k % leaves.size();
        if (leaves[i].solid_ahead) {
            if (k < leaves.size()) open.push_back(leaves[i].half_edge);
        } else if (!closed[i] && !open.empty()) {
            pairs.emplace_back(open.back(), leaves[i].half_edge);
            open.pop_back();
            closed[i] = true;
        }
    }
    return pairs;
}

}  // namespace ellicast::sender
