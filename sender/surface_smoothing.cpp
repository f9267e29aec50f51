// sender/surface_smoothing.cpp
#include "sender/surface_smoothing.hpp"

#include <cassert>
#include <cmath>
#include <cstddef>

namespace ellicast::sender {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

// Number of neighbours of each vertex, counted once for every triangle that holds both.
std::vector<double> neighbour_counts(const TriangleMesh& mesh) {
    std::vector<double> counts(mesh.positions.size(), 0.0);
    for (const Triangle& triangle : mesh.triangles) {
        for (const std::uint32_t corner : triangle) counts[corner] += 2.0;
    }
    return counts;
}

}  // namespace

std::vector<Vector3d> smoothed_positions(const TriangleMesh& mesh, int steps) {
    assert(steps >= 0);
    std::vector<Vector3d> positions = mesh.positions;
    if (steps == 0) return positions;
    const std::vector<double> counts = neighbour_counts(mesh);
    std::vector<Vector3d> sums(positions.size());
    for (int step = 0; step < steps; ++step) {
        std::fill(sums.begin(), sums.end(), Vector3d::Zero());
        for (const Triangle& t : mesh.triangles) {
            const Vector3d all = positions[t[0]] + positions[t[1]] + positions[t[2]];
            for (const std::uint32_t corner : t) sums[corner] += all - positions[corner];
        }
        for (std::size_t v = 0; v < positions.size(); ++v) {
            if (counts[v] > 0.0) positions[v] = 0.5 * (positions[v] + sums[v] / counts[v]);
        }
    }
    return positions;
}

int default_smoothing_steps(const TriangleMesh& mesh) {
    // One step moves a vertex by about a quarter of edge^2 x curvature. The reference scans of 35
    // to 48 thousand vertices have mean edges near 0.005 and profit from 3 steps; at 10 thousand
    // (0.01) one is best, and below, where edges are the size of the features, any step costs
    // coverage.
    const double edge = common::mean_edge_length(mesh);
    if (edge < 0.003) return 3;
    if (edge < 0.012) return 1;
    return 0;
}

}  // namespace ellicast::sender
