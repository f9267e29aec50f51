// sender/diagonal_rule.hpp
#pragma once

#include <cstdint>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

class Quads;

/// The rule of common/diagonal_choice.hpp that a receiver of all vertices does best with: of every
/// edge's two triangles, would it keep the diagonal? A wrong one costs the area of the quad times
/// the squared distance of the two diagonals; the rule of the least sum wins, of equals the first.
/// `normal_bits` of the tags, 0 for none. Of more than 2^20 half-edges every second, third, ... is
/// asked. `solid`: closed. Linear. Threads do not change the result.
std::uint8_t best_diagonal_rule(const common::TriangleMesh& solid, int normal_bits,
                                unsigned threads = 0);
/// The same of the solid's quads with received_normals().
std::uint8_t best_diagonal_rule(const common::TriangleMesh& solid, const Quads& quads, bool tagged,
                                unsigned threads);

}  // namespace ellicast::sender
