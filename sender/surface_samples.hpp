// sender/surface_samples.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/random.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// Points of a surface with the unit normals that point into the solid (zero where the surface is
/// degenerate). Two arrays of one length. "Inward" takes a closed, outward oriented mesh for
/// granted.
struct SurfaceSamples {
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Vector3d> inward;
};

/// Indices of the vertices that a triangle uses, ascending.
std::vector<std::uint32_t> used_vertices(const common::TriangleMesh& mesh);

/// Inward unit normals of all vertices, weighted as [M99] does (N. Max, Weights for computing
/// vertex normals from facet normals, 1999); zero where undefined.
std::vector<Eigen::Vector3d> inward_vertex_normals(const common::TriangleMesh& mesh);

/// `count` points stratified by area: triangle areas are accumulated in index order, point k lies
/// at area (k + jitter) / count, uniform inside its triangle, with its triangle's normal. Empty
/// when the mesh has no area.
SurfaceSamples random_surface_points(const common::TriangleMesh& mesh, std::size_t count,
                                     common::Random& random);

/// Where growth starts ([BK02] section 3.1: on the surface): up to one half of the seeds are
/// vertices drawn at random, which stand where the mesh is fine, the others are stratified by area,
/// which stand wherever there is surface ([BK02] has vertices alone; large triangles would then
/// grow nothing). Fewer than `count` only where normals are undefined. Follows `seed` alone.
SurfaceSamples place_seeds(const common::TriangleMesh& mesh, std::size_t count, std::uint64_t seed);

}  // namespace ellicast::sender
