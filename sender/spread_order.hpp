// sender/spread_order.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ellicast::sender {

/// Seeded stratified order: the k-th prefix of any length is an even sample of the surface. Ranks
/// along a Morton curve are visited in bit-reversed order, shuffled inside strata by the seed. Any
/// 2^d visits that follow each other at an odd stride and begin at a multiple of 2^d strides lie in
/// 2^d different parts of the curve. Returns a permutation of 0..n-1. Cost: n log n. Requires
/// finite positions.
std::vector<std::uint32_t> spread_order(const std::vector<Eigen::Vector3d>& positions,
                                        std::uint64_t seed);

}  // namespace ellicast::sender
