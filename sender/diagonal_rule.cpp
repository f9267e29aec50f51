// sender/diagonal_rule.cpp
#include "sender/diagonal_rule.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "common/octahedral_normal.hpp"
#include "common/vertex_normals.hpp"
#include "sender/edge_table.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

Vector3d area_vector(const TriangleMesh& mesh, std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vector3d& p = mesh.positions[a];
    return (mesh.positions[b] - p).cross(mesh.positions[c] - p);
}

/// The normals that a receiver will have.
std::vector<Vector3d> known_normals(const TriangleMesh& mesh, int normal_bits) {
    if (normal_bits == 0) return common::vertex_normals(mesh);
    std::vector<Vector3d> normals(mesh.positions.size(), Vector3d::Zero());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t v : mesh.triangles[t]) normals[v] += area_vector(mesh, t);
    }
    for (Vector3d& n : normals) {
        n = common::decode_normal(common::encode_normal(n, normal_bits), normal_bits);
    }
    return normals;
}

/// The half-edge on the other side of each; kNone where there is not exactly one.
std::vector<HalfEdge> twins_of(const TriangleMesh& mesh) {
    std::vector<HalfEdge> twins(3 * mesh.triangles.size(), kNone);
    for_each_edge(mesh.triangles, mesh.positions.size(), [&](std::span<const HalfEdge> edge) {
        if (edge.size() != 2) return;
        twins[edge[0]] = edge[1];
        twins[edge[1]] = edge[0];
    });
    return twins;
}

class Quads {
  public:
    Quads(const TriangleMesh& mesh, const std::vector<Vector3d>& normals)
        : mesh_(mesh), normals_(normals), twins_(twins_of(mesh)) {}

    /// Calls visit(quad, its two triangles' area together) for every edge.
    template <class Visit>
    void for_each(const Visit& visit) const {
        for (HalfEdge h = 0; h < twins_.size(); ++h) {
            const HalfEdge t = twins_[h];
            if (t == kNone || t < h) continue;
            const auto& triangles = mesh_.triangles;
            const std::array<std::uint32_t, 4> id = {origin(triangles, h), target(triangles, h),
                                                     target(triangles, next_in_triangle(h)),
                                                     target(triangles, next_in_triangle(t))};
            if (id[2] == id[3] || id[0] != target(triangles, t)) continue;
            common::Quad quad;
            quad.a = mesh_.positions[id[0]];
            quad.b = mesh_.positions[id[1]];
            quad.c = mesh_.positions[id[2]];
            quad.d = mesh_.positions[id[3]];
            const HalfEdge bc = next_in_triangle(h);
            const HalfEdge ad = next_in_triangle(t);
            quad.outer_normals = {beyond(bc), beyond(next_in_triangle(bc)), beyond(ad),
                                  beyond(next_in_triangle(ad))};
            for (std::size_t k = 0; k < 4; ++k) quad.vertex_normals[k] = normals_[id[k]];
            visit(quad, 0.5 * (area_vector(mesh_, triangle_of(h)).norm() +
                               area_vector(mesh_, triangle_of(t)).norm()));
        }
    }

  private:
    [[nodiscard]] Vector3d beyond(HalfEdge h) const {
        const HalfEdge t = twins_[h];
        return area_vector(mesh_, triangle_of(t == kNone ? h : t));
    }

    const TriangleMesh& mesh_;
    const std::vector<Vector3d>& normals_;
    std::vector<HalfEdge> twins_;
};

double squared_gap(const common::Quad& q) {
    const Vector3d across = (q.b - q.a).cross(q.d - q.c);
    const double size = across.norm();
    if (!(size > 0.0)) return 0.0;
    const double gap = (q.c - q.a).dot(across) / size;
    return gap * gap;
}

double mean_edge_length(const TriangleMesh& mesh) {
    double sum = 0.0;
    for (const common::Triangle& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            sum += (mesh.positions[t[k]] - mesh.positions[t[(k + 1) % 3]]).norm();
        }
    }
    return mesh.triangles.empty() ? 0.0 : sum / (3.0 * static_cast<double>(mesh.triangles.size()));
}

}  // namespace

std::uint8_t best_diagonal_rule(const TriangleMesh& solid, int normal_bits) {
    const std::vector<Vector3d> normals = known_normals(solid, normal_bits);
    const double unit = mean_edge_length(solid);
    std::array<double, common::kDiagonalRules> cost{};
    Quads(solid, normals).for_each([&](const common::Quad& quad, double area) {
        const common::DiagonalGain gain = common::diagonal_gain(quad);
        const double wrong = area * squared_gap(quad);
        for (std::uint8_t rule = 0; rule < common::kDiagonalRules; ++rule) {
            const auto weights = common::diagonal_weights(rule, normal_bits > 0, 0.0);
            const double gained = gain.weighed(weights.angle, weights.rise, unit);
            if (gained > common::kLeastDiagonalGain * unit) cost[rule] += wrong;
        }
    });
    return static_cast<std::uint8_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
}

}  // namespace ellicast::sender
