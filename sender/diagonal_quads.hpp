// sender/diagonal_quads.hpp: private to sender/broadcast_object, sender/diagonal_rule,
// sender/diagonal_marks and sender/costly_edges.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "common/octahedral_normal.hpp"
#include "common/parallel.hpp"
#include "common/triangle_mesh.hpp"
#include "common/vertex_normals.hpp"
#include "sender/edge_table.hpp"

namespace ellicast::sender {

inline Eigen::Vector3d area_vector(const common::TriangleMesh& mesh, std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Eigen::Vector3d& p = mesh.positions[a];
    return (mesh.positions[b] - p).cross(mesh.positions[c] - p);
}

/// Of the faces around each vertex, summed; not of unit length.
inline std::vector<Eigen::Vector3d> area_normals(const common::TriangleMesh& mesh) {
    std::vector<Eigen::Vector3d> normals(mesh.positions.size(), Eigen::Vector3d::Zero());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const Eigen::Vector3d area = area_vector(mesh, t);
        for (const std::uint32_t v : mesh.triangles[t]) normals[v] += area;
    }
    return normals;
}

/// The normals that a receiver decodes from tags of so many bits, not 0, where nothing is marked.
inline std::vector<Eigen::Vector3d> decoded_normals(const common::TriangleMesh& mesh, int bits,
                                                    unsigned threads) {
    std::vector<Eigen::Vector3d> normals = area_normals(mesh);
    common::parallel_for(normals.size(), threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            normals[v] =
                common::decode_normal(common::encode_marked_normal(normals[v], bits, false), bits);
        }
    });
    return normals;
}

/// The half-edge on the other side of each; kNone where there is not exactly one.
inline std::vector<HalfEdge> twins_of(const common::TriangleMesh& mesh, unsigned threads) {
    std::vector<HalfEdge> twins(3 * mesh.triangles.size(), kNone);
    const auto join = [&](std::span<const HalfEdge> edge) {
        if (edge.size() != 2) return;
        twins[edge[0]] = edge[1];
        twins[edge[1]] = edge[0];
    };
    for_each_edge(mesh.triangles, mesh.positions.size(), join, threads);
    return twins;
}

/// What a receiver of all vertices goes by: decoded tags of so many bits, or, for 0, normals of its
/// own.
inline std::vector<Eigen::Vector3d> received_normals(const common::TriangleMesh& mesh, int bits,
                                                     unsigned threads) {
    return bits > 0 ? decoded_normals(mesh, bits, threads) : common::vertex_normals(mesh);
}

/// Edges between two triangles, as quads of common/diagonal_choice.hpp. All answers are constant
/// time, and many threads may ask. Takes seconds for millions of triangles; mesh and normals must
/// outlive it. Memory: 12 bytes a triangle.
class Quads {
  public:
    Quads(const common::TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& normals,
          unsigned threads)
        : mesh_(mesh), normals_(normals), twins_(twins_of(mesh, threads)) {}

    [[nodiscard]] std::size_t half_edges() const { return twins_.size(); }

    /// Whether h speaks for an edge between two triangles that make a quad.
    [[nodiscard]] bool has_quad(HalfEdge h) const {
        const HalfEdge t = twins_[h];
        if (t == kNone || t < h) return false;
        const std::array<std::uint32_t, 4> id = ids(h);
        return id[2] != id[3] && id[0] == target(mesh_.triangles, t);
    }
    /// Of a, b, c and d. This and what follows require has_quad(h).
    [[nodiscard]] std::array<std::uint32_t, 4> ids(HalfEdge h) const {
        const auto& triangles = mesh_.triangles;
        return {origin(triangles, h), target(triangles, h), target(triangles, next_in_triangle(h)),
                target(triangles, next_in_triangle(twins_[h]))};
    }
    [[nodiscard]] common::Quad quad(HalfEdge h) const {
        const std::array<std::uint32_t, 4> id = ids(h);
        common::Quad quad;
        quad.a = mesh_.positions[id[0]];
        quad.b = mesh_.positions[id[1]];
        quad.c = mesh_.positions[id[2]];
        quad.d = mesh_.positions[id[3]];
        const HalfEdge bc = next_in_triangle(h);
        const HalfEdge ad = next_in_triangle(twins_[h]);
        quad.outer_normals = {beyond(bc), beyond(next_in_triangle(bc)), beyond(ad),
                              beyond(next_in_triangle(ad))};
        for (std::size_t k = 0; k < 4; ++k) quad.vertex_normals[k] = normals_[id[k]];
        return quad;
    }
    /// What a wrong diagonal adds to the squared error: the quad's area times the squared distance
    /// of the lines that the diagonals lie on; 0 for parallel ones.
    [[nodiscard]] double wrong_diagonal(HalfEdge h) const {
        const auto [a, b, c, d] = ids(h);
        const auto& x = mesh_.positions;
        const Eigen::Vector3d across = (x[b] - x[a]).cross(x[d] - x[c]);
        const double size = across.norm();
        if (!(size > 0.0)) return 0.0;
        const double gap = (x[c] - x[a]).dot(across) / size;
        const double area = 0.5 * (area_vector(mesh_, triangle_of(h)).norm() +
                                   area_vector(mesh_, triangle_of(twins_[h])).norm());
        return area * (gap * gap);
    }

  private:
    [[nodiscard]] Eigen::Vector3d beyond(HalfEdge h) const {
        const HalfEdge t = twins_[h];
        return area_vector(mesh_, triangle_of(t == kNone ? h : t));
    }

    const common::TriangleMesh& mesh_;
    const std::vector<Eigen::Vector3d>& normals_;
    std::vector<HalfEdge> twins_;
};

}  // namespace ellicast::sender
