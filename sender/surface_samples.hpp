// sender/surface_samples.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/random.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// A point that moves with its mesh: sum of weights[i] times corner i. Weights are at least 0,
/// sum 1.
struct SurfacePoint {
    std::array<std::uint32_t, 3> corners{0, 0, 0};  // indices into TriangleMesh::positions
    Eigen::Vector3d weights = Eigen::Vector3d(1.0, 0.0, 0.0);

    [[nodiscard]] Eigen::Vector3d position(const std::vector<Eigen::Vector3d>& positions) const {
        return weights[0] * positions[corners[0]] + weights[1] * positions[corners[1]] +
               weights[2] * positions[corners[2]];
    }
};

/// Points of a surface with the unit normals that point into the solid (zero where the surface is
/// degenerate). Two arrays of one length.
struct SurfaceSamples {
    std::vector<SurfacePoint> points;
    std::vector<Eigen::Vector3d> inward;
};

/// Every vertex that a triangle uses (in index order), then points on long edges, then points
/// inside large triangles, so that no point of the surface is further than `spacing` from a sample.
/// [BK02] tests vertices alone, which fails on coarse and CAD-like meshes (DESIGN section 3). An
/// edge of length l gets ceil(l / spacing) - 1 points, each point once however many triangles share
/// the edge; a triangle gets rows parallel to its longest edge, so that slivers cost no more than
/// their area. Normals: vertices weighted as [M99] does, edges the mean of their triangles,
/// triangles their own. Requires spacing > 0 (asserted), a closed outward mesh for "inward" to mean
/// what it says.
SurfaceSamples sample_surface(const common::TriangleMesh& mesh, double spacing);

/// Spacing that suits a mesh of bounding-box diagonal 1: 0.01 when much of the area lies in large,
/// CAD-like triangles, else 0.02.
double default_sample_spacing(const common::TriangleMesh& mesh);

/// `count` points stratified by area: triangle areas are accumulated in index order, point k lies
/// at area (k + jitter) / count, uniform inside its triangle, with its triangle's normal. Empty
/// when the mesh has no area.
SurfaceSamples random_surface_points(const common::TriangleMesh& mesh, std::size_t count,
                                     common::Random& random);

/// Inward unit normals of all vertices, weighted as [M99] does (N. Max, Weights for computing
/// vertex normals from facet normals, 1999); zero where undefined.
std::vector<Eigen::Vector3d> inward_vertex_normals(const common::TriangleMesh& mesh);

}  // namespace ellicast::sender
