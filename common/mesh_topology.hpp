// common/mesh_topology.hpp
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// What can be said of a triangle set from its indices alone (volumes apart). Unreferenced vertices
/// do not count.
struct MeshTopology {
    std::size_t vertices = 0;  // referenced ones
    std::size_t edges = 0;
    std::size_t faces = 0;
    std::size_t boundary_edges = 0;         // with one triangle
    std::size_t non_manifold_edges = 0;     // with more than two, or two of opposite orientation
    std::size_t non_manifold_vertices = 0;  // whose triangles form more than one fan
    std::size_t components = 0;             // connected by edges
    std::int64_t euler = 0;                 // V - E + F
    std::int64_t euler_largest = 0;         // of the component with the largest |volume|
    bool closed = false;                    // at least one face, no boundary edge
    bool manifold = false;                  // no non-manifold edge or vertex (boundary allowed)

    /// Genus in all, components - euler / 2; meaningful for a closed manifold.
    [[nodiscard]] std::int64_t genus() const {
        return static_cast<std::int64_t>(components) - euler / 2;
    }
};

/// Linear in the mesh. Requires indices in range (asserted).
MeshTopology analyse_topology(const TriangleMesh& mesh);

/// Component of every triangle (edge-connected), numbered from 0 in order of first triangle.
std::vector<std::uint32_t> triangle_components(const TriangleMesh& mesh);

/// Smallest box that holds all triangles, whatever unreferenced vertices there are; Eigen's empty
/// box when there is no triangle.
Eigen::AlignedBox3d surface_box(const TriangleMesh& mesh);

/// Signed volume by the divergence theorem; positive for outward orientation. Meaningful when
/// closed.
double signed_volume(const TriangleMesh& mesh);

}  // namespace ellicast::common
