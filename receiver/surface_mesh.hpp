// receiver/surface_mesh.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::receiver {

using VertexId = std::uint32_t;
using FaceId = std::uint32_t;
using HalfedgeId = std::uint32_t;  // 3 * face + corner; runs from that corner to the next one
inline constexpr std::uint32_t kNone = 0xffffffffu;

/// A closed, oriented triangle 2-manifold under surgery: three flat arrays and no more, for the
/// loops that insert and remove hundreds of thousands of vertices. Every edit keeps the mesh a
/// closed simplicial 2-manifold of the same topology (Euler characteristic and components); edits
/// that could break that have a can_ test, and calling them without a yes from it is a fault of
/// ours (asserted). Identifiers are stable; dead faces and vertices keep their slot until
/// extract().
class SurfaceMesh {
  public:
    SurfaceMesh() = default;

    /// Requires a closed, consistently oriented 2-manifold with every vertex in use; empty
    /// otherwise.
    static std::optional<SurfaceMesh> from(const common::TriangleMesh& mesh);

    /// Room for so many more vertices and their faces, so that no array is moved meanwhile.
    void reserve(std::size_t more_vertices);

    /// Slots without a vertex or face. Threads that work on different parts of the mesh
    /// (MeshRegions) take new ones from their own and leave there what they remove.
    struct Slots {
        std::vector<VertexId> vertices;      // the next is the last
        std::vector<FaceId> faces;           // likewise
        std::ptrdiff_t vertices_gained = 0;  // by surgery with these
    };
    /// New slots for so many vertices and their faces.
    [[nodiscard]] Slots take_slots(std::size_t vertices);
    /// What is left of them is the mesh's again.
    void give_back(Slots slots);

    [[nodiscard]] std::size_t vertex_slots() const { return positions_.size(); }
    [[nodiscard]] std::size_t face_slots() const { return corners_.size() / 3; }
    [[nodiscard]] bool vertex_alive(VertexId v) const { return outgoing_[v] != kNone; }
    [[nodiscard]] bool face_alive(FaceId f) const { return corners_[3 * std::size_t{f}] != kNone; }

    [[nodiscard]] const Eigen::Vector3d& position(VertexId v) const { return positions_[v]; }
    void set_position(VertexId v, const Eigen::Vector3d& p) { positions_[v] = p; }

    static FaceId face_of(HalfedgeId h) { return h / 3; }
    static HalfedgeId halfedge(FaceId f, unsigned corner) { return 3 * f + corner; }
    static HalfedgeId next(HalfedgeId h) { return h % 3 == 2 ? h - 2 : h + 1; }
    static HalfedgeId prev(HalfedgeId h) { return h % 3 == 0 ? h + 2 : h - 1; }
    [[nodiscard]] HalfedgeId twin(HalfedgeId h) const { return twins_[h]; }
    [[nodiscard]] VertexId from_vertex(HalfedgeId h) const { return corners_[h]; }
    [[nodiscard]] VertexId to_vertex(HalfedgeId h) const { return corners_[next(h)]; }
    [[nodiscard]] VertexId opposite(HalfedgeId h) const { return corners_[prev(h)]; }
    [[nodiscard]] HalfedgeId outgoing(VertexId v) const { return outgoing_[v]; }
    [[nodiscard]] std::array<VertexId, 3> face(FaceId f) const {
        const std::size_t h = 3 * std::size_t{f};
        return {corners_[h], corners_[h + 1], corners_[h + 2]};
    }
    /// Next outgoing half-edge around h's start, clockwise seen from outside.
    [[nodiscard]] HalfedgeId rotate(HalfedgeId h) const { return next(twins_[h]); }

    /// Calls visit(h) for every half-edge that leaves v.
    template <class Visit>
    void for_each_outgoing(VertexId v, const Visit& visit) const {
        const HalfedgeId start = outgoing_[v];
        HalfedgeId h = start;
        do {
            visit(h);
            h = rotate(h);
        } while (h != start);
    }
    [[nodiscard]] std::size_t valence(VertexId v) const;
    [[nodiscard]] bool adjacent(VertexId a, VertexId b) const;

    /// 1-to-3 split: a new vertex at p inside f. f stays one of the three.
    VertexId split_face(FaceId f, const Eigen::Vector3d& p) {
        return split_face(f, grow(p), slots_);
    }
    /// 2-to-4 split: a new vertex at p on h's edge. Both old faces stay among the four.
    VertexId split_edge(HalfedgeId h, const Eigen::Vector3d& p) {
        return split_edge(h, grow(p), slots_);
    }
    /// The same with slots of one's own, which must suffice.
    VertexId split_face(FaceId f, const Eigen::Vector3d& p, Slots& slots);
    VertexId split_edge(HalfedgeId h, const Eigen::Vector3d& p, Slots& slots);

    /// False when the flipped edge exists already or an end would be left with valence below 3.
    [[nodiscard]] bool can_flip(HalfedgeId h) const;
    /// Replaces edge (from, to) by the edge between the two opposite vertices. h and its twin
    /// become it.
    void flip(HalfedgeId h);

    /// The link condition ([DEGN99]) for moving h's start onto its end; also keeps at least 4
    /// vertices.
    [[nodiscard]] bool can_collapse(HalfedgeId h) const;
    /// Removes h's start vertex and two faces.
    void collapse(HalfedgeId h) { collapse(h, slots_); }
    void collapse(HalfedgeId h, Slots& slots);

    /// Twice the area times the unit normal.
    [[nodiscard]] Eigen::Vector3d area_normal(FaceId f) const;

    /// Live faces and vertices, in slot order. `vertex_of` gets the slot of each extracted vertex.
    [[nodiscard]] common::TriangleMesh extract(std::vector<VertexId>* vertex_of = nullptr) const;

    /// "" when every invariant holds, else what is broken. Linear; for tests and debug builds.
    [[nodiscard]] std::string validate() const;

  private:
    /// Sets the twins; false when an edge has not two half-edges of opposite directions.
    bool pair_halfedges();
    /// Slots for one vertex and two faces more, where the mesh's own do not suffice. Gives p where
    /// it stays: p may be a position of the mesh, which growing moves.
    const Eigen::Vector3d& grow(const Eigen::Vector3d& p);
    VertexId new_vertex(const Eigen::Vector3d& p, Slots& slots);
    static FaceId new_face(Slots& slots);
    void set_face(FaceId f, VertexId a, VertexId b, VertexId c);
    void link(HalfedgeId a, HalfedgeId b) {
        twins_[a] = b;
        twins_[b] = a;
    }

    std::vector<Eigen::Vector3d> positions_;
    std::vector<VertexId> corners_;     // 3 per face; kNone in dead faces
    std::vector<HalfedgeId> twins_;     // 3 per face
    std::vector<HalfedgeId> outgoing_;  // per vertex; kNone when dead
    [[nodiscard]] std::size_t live_vertices() const {
        return live_vertices_ + static_cast<std::size_t>(slots_.vertices_gained);
    }
    Slots slots_;
    std::size_t live_vertices_ = 0;  // but for what slots_ gained
};

/// Unit normal at a live vertex: of its faces, each by its angle and sides as in
/// common::vertex_normals.
Eigen::Vector3d vertex_normal(const SurfaceMesh& mesh, VertexId v);

/// Mean over all live faces' edges; 0 without any. Linear, on `threads` threads (0: one per core),
/// which do not change the result.
double mean_edge_length(const SurfaceMesh& mesh, unsigned threads = 1);

}  // namespace ellicast::receiver
