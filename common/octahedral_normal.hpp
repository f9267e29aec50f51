// common/octahedral_normal.hpp
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace ellicast::common {

/// Directions in 8, 12 or 16 bits: the sphere is projected onto an octahedron, its lower half
/// folded outward, and the square that this gives cut into 2^(bits/2) x 2^(bits/2) cells
/// ([C14]). The code is the cell's row times the columns plus its column; it stands
/// for the direction of the cell's centre, so that no code is wasted.

/// The code whose direction is nearest to `n`, which need not be of unit length; of equally near
/// ones one that is fixed but not said. A vector without a direction (zero, not finite) gives 0.
/// Requires bits of 8, 12 or 16 (asserted).
std::uint16_t encode_normal(const Eigen::Vector3d& n, int bits);

/// A code can say one thing more than a direction: those with odd row and odd column are marked.
/// What a mark means is the business of whoever sets it (common/diagonal_choice.hpp).
[[nodiscard]] bool is_marked(std::uint16_t code, int bits);

/// As encode_normal, but among the codes that are marked or not, as asked; near the edge of the
/// square perhaps the second nearest of them. A vector without a direction gives the lowest code.
std::uint16_t encode_marked_normal(const Eigen::Vector3d& n, int bits, bool marked);

/// Of unit length, whatever the code; higher bits of it are ignored. Same requirement.
Eigen::Vector3d decode_normal(std::uint16_t code, int bits);

/// The largest angle between a direction and that of its nearest code, in radians, rounded up. Same
/// requirement.
double normal_cell_angle(int bits);

}  // namespace ellicast::common
