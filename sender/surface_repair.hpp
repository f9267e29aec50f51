// sender/surface_repair.hpp: private to sender/model_preparation.
#pragma once

#include <cstddef>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "sender/edge_table.hpp"

namespace ellicast::sender {

/// What was done to make a set of triangles a closed, oriented 2-manifold.
struct SurfaceRepair {
    std::size_t turned_triangles = 0;    // to agree with their neighbours
    std::size_t cut_edges = 0;           // where a one-sided part was opened
    std::size_t non_manifold_edges = 0;  // of more than two triangles
    std::size_t split_vertices = 0;      // where separate fans met
    std::size_t holes = 0;               // boundary loops closed
};

/// Makes `mesh` closed, manifold by its indices and oriented alike within each connected part. No
/// position moves or leaves; copies, centres and midpoints are appended, and the triangles of
/// holes.
///  1. Neighbours across edges of two triangles are turned alike, as the majority of their patch
///  has it;
///     where a patch contradicts itself (Moebius) the edge at which that shows is cut.
///  2. At edges of more triangles, those that enclose the solid between them are joined, so that
///  bodies that
///     touch along an edge come apart.
///  3. A vertex where several fans meet gets a copy for each.
///  4. Boundary loops are closed: two edges by joining them, three by a triangle, more by a fan
///  about their
///     centroid.
///  5. Where a body touches itself, step 2 can leave one edge with two pairs of triangles; all but
///  the first
///     pair get a midpoint.
/// Requires clean triangles (sender/triangle_cleaning.hpp). Deterministic; about linear.
SurfaceRepair make_closed_manifold(common::TriangleMesh& mesh);

}  // namespace ellicast::sender
