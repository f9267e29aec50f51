// sender/edge_pairing.hpp: private to sender/model_preparation.
#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "sender/edge_table.hpp"

namespace ellicast::sender {

/// Joins the triangles around one edge in pairs that enclose the solid between them: turning about
/// the edge, a triangle that has the solid ahead goes with the next one that has it behind. Each
/// pair runs along the edge in opposite directions; what finds no partner is left out. `edge`:
/// half-edges of one undirected edge. Ties by angle go to the one that has the solid behind, then
/// by index.
std::vector<std::pair<HalfEdge, HalfEdge>> pair_around_edge(
    const std::vector<Eigen::Vector3d>& positions, const std::vector<common::Triangle>& triangles,
    std::span<const HalfEdge> edge);

}  // namespace ellicast::sender
