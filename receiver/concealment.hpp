// receiver/concealment.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::receiver {

/// What the ellipsoids say of the surface between received vertices.
struct ShapeGuide {
    const common::TriangleTree* surface = nullptr;  // coarse surface, wrapped to the vertices
    double cell = 0;                                // its resolution
};

/// A vertex of a surface with gaps.
struct KnownVertex {
    Eigen::Vector3d normal;  // unit
    double doubt = 0;        // distance from here to the coarse surface before it was wrapped
};

/// How much of their bulge edges get.
struct Gaps {
    /// Share of the vertices that is missing anywhere, 0 to 1: the less, the larger an edge must be
    /// among its neighbours to bulge, for the original has the others.
    double missing = 0;
    /// What every edge gets, 0 to 1: where what is missing is missing everywhere.
    double least_strength = 0;
};

struct Concealed {
    common::TriangleMesh mesh;
    /// Of guessed vertex k, at position (known vertices) + k: the ends of the edge that it split.
    std::vector<std::array<std::uint32_t, 2>> parents;
};

/// Guesses the vertices that are missing: splits edges at midpoints that bulge as the normals at
/// their ends ask for (DESIGN section 7, "Concealment": the harmonic mean of what the two ends ask
/// for, so that a crease stays a crease), as the other diagonal asks for, and as the coarse surface
/// does where it was right at the ends. Edges longer than two cells are split again. Positions of
/// the mesh stay bit for bit and keep their places; guessed ones follow. Edges that would not bulge
/// are not split; triangles are cut to fit: a closed manifold stays one, of the same topology.
/// Cost: linear, and a search of the guide per edge.
Concealed conceal(const common::TriangleMesh& mesh, std::vector<KnownVertex> vertices,
                  const ShapeGuide& guide, const Gaps& gaps, unsigned threads);

/// Where triangles intersect, halves the bulge of guessed vertices, up to three times and then all
/// of it. What intersects without a guess stays as it is. Returns how many triangles still do, as
/// count_self_intersections() counts. Cost: a search for every triangle, and a few for those that
/// move.
std::size_t flatten_intersections(Concealed& concealed, unsigned threads);

}  // namespace ellicast::receiver
