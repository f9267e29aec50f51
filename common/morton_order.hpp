// common/morton_order.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ellicast::common {

/// Indices along a Morton curve through the bounding cube, 2^21 cells an axis; ties by index.
/// Requires finite positions. Cost: linear, six passes of a radix sort; 32 bytes a position.
std::vector<std::uint32_t> morton_order(const std::vector<Eigen::Vector3d>& positions);

}  // namespace ellicast::common
