// tests/support/floor.hpp: the floor of a blind reconstruction, and meshes by decimation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// A mesh after half-edge collapses.
struct Collapsed {
    common::TriangleMesh mesh;           // positions of the original; the lost unreferenced
    std::vector<std::uint32_t> removed;  // vertices, in the order in which they went
    std::size_t remaining = 0;           // lost vertices that no rule could remove
    std::size_t forced = 0;              // removed only by turning a triangle over
};

/// What an imaginary receiver that knew the connectivity would show: the original mesh from which
/// the vertices with kept[v] == false are taken away by half-edge collapses. A lost vertex goes
/// onto that surviving neighbour which lies nearest to the planes of the lost vertex's own original
/// triangles (sum of squares weighted by area: its quadric [GH97]); cheapest first. This rule is
/// the one whose errors are those of the published floor; collapsing onto lost neighbours too, with
/// summed quadrics, is 5-20 % worse at heavy loss. Survivors stay bit for bit where they are. What
/// this leaves, for the topology or because a triangle would turn over, goes onto any neighbour, at
/// last with triangles turned over, and after edge flips that free it; topology never changes.
/// Requires kept.size() == positions.size() (asserted). Deterministic: ties by index. n log n.
Collapsed collapse_lost(const common::TriangleMesh& original, const std::vector<bool>& kept);

/// The mesh alone.
common::TriangleMesh collapse_onto(const common::TriangleMesh& original,
                                   const std::vector<bool>& kept);

/// Decimation of the whole mesh, with quadrics summed along collapses ([GH97]), until `vertices`
/// are left or nothing more can go. Vertices without triangles go first. `removed` does not depend
/// on `vertices` but for its length.
Collapsed decimate(const common::TriangleMesh& original, std::size_t vertices);

}  // namespace ellicast::tests
