// tests/support/sampling_gaps.hpp: how evenly some points stand for others.
#pragma once

#include <Eigen/Core>
#include <span>

namespace ellicast::tests {

/// Distances from points to the nearest sample, in the points' unit.
struct SamplingGaps {
    double percentile_99 = 0;
    double largest = 0;
};

/// Requires points and samples (asserted). Where samples are about even among the points, linear in
/// the number of points.
SamplingGaps sampling_gaps(std::span<const Eigen::Vector3d> points,
                           std::span<const Eigen::Vector3d> samples);

}  // namespace ellicast::tests
