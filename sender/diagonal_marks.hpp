// sender/diagonal_marks.hpp
#pragma once

#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

class Quads;

/// Per vertex of `solid`: 1 where its normal tag is to be marked (common/octahedral_normal.hpp). A
/// receiver of all vertices that goes by the diagonal rule `rule` gets some diagonals wrong; it
/// prefers one between two marked vertices (common/diagonal_choice.hpp). Marks both ends of the
/// edges whose loss would cost most, the costliest first, as far as that spoils less elsewhere than
/// it saves. `solid`: closed; `normal_bits` of the tags, not 0. Deterministic; threads do not
/// change the result. Cost: linear, some 50 ns an edge on large models, and memory for what is near
/// the edges that may be marked.
std::vector<char> diagonal_marks(const common::TriangleMesh& solid, int normal_bits,
                                 std::uint8_t rule, unsigned threads = 0);
/// The same of the solid's quads with received_normals(); `mistakes` is what all of the rule's cost
/// (rule_costs()).
std::vector<char> diagonal_marks(const common::TriangleMesh& solid, const Quads& quads,
                                 std::uint8_t rule, double mistakes, unsigned threads);

}  // namespace ellicast::sender
