// sender/importance_order.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ellicast::sender {

/// Where the strata of an importance order of that many vertices begin, and where the last one
/// ends: 0 < ... < n/4 < n/2 < n, rounded up; the first holds fewer than 512. A stratum holds the
/// vertices of one scale; in it they go in spread order. {0} without vertices.
std::vector<std::uint32_t> importance_strata(std::uint32_t vertices);

/// Positions in descending order of importance, rearranged inside each stratum into a spread order:
/// so every prefix is as good a model as its strata make it, and an even one, and 2^d vertices that
/// follow each other inside a stratum at an odd stride lie in 2^d different parts of it. Returns a
/// permutation of 0..n-1. Cost: n log n. Requires finite positions.
std::vector<std::uint32_t> spread_within_strata(const std::vector<Eigen::Vector3d>& positions,
                                                std::uint64_t seed);

}  // namespace ellicast::sender
