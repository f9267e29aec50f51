// sender/diagonal_rule.hpp
#pragma once

#include <array>
#include <cstdint>

#include "common/diagonal_choice.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

class Quads;

/// What the mistakes of each rule of common/diagonal_choice.hpp cost a receiver of all vertices: of
/// every edge's two triangles, would it keep the diagonal? A wrong one costs the area of the quad
/// times the squared distance of the two diagonals. Of more than 2^20 half-edges every second,
/// third, ... is asked and counts for so many. `quads` are those of `solid`, which is closed, with
/// received_normals(), tags if `tagged`. Linear. Threads do not change the result.
using RuleCosts = std::array<double, common::kDiagonalRules>;
RuleCosts rule_costs(const common::TriangleMesh& solid, const Quads& quads, bool tagged,
                     unsigned threads);

/// The rule that costs least, of equals the first.
std::uint8_t best_diagonal_rule(const RuleCosts& costs);

}  // namespace ellicast::sender
