// sender/decimated_mesh.hpp: private to sender/surface_decimation.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "sender/collapse_cost.hpp"
#include "sender/edge_table.hpp"

namespace ellicast::sender {

/// A surface on the way to nothing. Vertices are named along a Morton curve and triangles by their
/// first vertex there, so that neighbours are near in memory, and the vertices of a range of names
/// make up a part of the surface. Half-edge 3 t + c is also the corner c of triangle t. The corners
/// of a vertex are a chain: so any set of triangles can be told, and two vertices become one by
/// joining their chains. Scaled to a box of at most 1.
struct DecimatedMesh {
    explicit DecimatedMesh(const common::TriangleMesh& surface);

    [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(label.size()); }

    std::vector<std::uint32_t> label;  // a vertex' index in the surface
    std::vector<Eigen::Vector3d> positions;
    std::vector<common::Triangle> triangles;  // a dead one begins with kNone
    std::vector<HalfEdge> first_corner;       // of a vertex
    std::vector<HalfEdge> next_corner;        // of the same vertex
    std::vector<Quadric> quadrics;
    std::vector<std::uint8_t> removed;  // bytes: neighbours may be written by two threads

    // Removed vertices bear witness of the surface that was: each is kept with the triangle next to
    // it.
    std::vector<std::uint32_t> witness_of;    // the first of a triangle
    std::vector<std::uint32_t> next_witness;  // of the same triangle
    std::vector<float> squared_distance;      // from that triangle
    std::vector<float> witnessed;             // area

  private:
    void place_vertices(const common::TriangleMesh& surface);
    void link_triangles(const common::TriangleMesh& surface);
    void add_quadrics();
};

}  // namespace ellicast::sender
