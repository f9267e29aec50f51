// common/triangle_mesh.hpp
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ellicast::common {

/// Corners of a triangle as indices into TriangleMesh::positions, counter-clockwise seen from
/// outside.
using Triangle = std::array<std::uint32_t, 3>;

/// Red green blue.
using Colour = std::array<std::uint8_t, 3>;

/// An indexed triangle set. It promises nothing about manifoldness; see common/mesh_topology.hpp
/// for what can be asked of it. Frame and unit: the model's own.
struct TriangleMesh {
    std::vector<Eigen::Vector3d> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours{};  // one for each position, or none at all
};

/// Smallest box that holds all positions; Eigen's empty box when there are none.
inline Eigen::AlignedBox3d bounding_box(const std::vector<Eigen::Vector3d>& positions) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : positions) box.extend(p);
    return box;
}

/// Mean over all triangles' edges; 0 without any. Linear.
inline double mean_edge_length(const TriangleMesh& mesh) {
    double sum = 0.0;
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) {
            sum += (mesh.positions[t[i]] - mesh.positions[t[(i + 1) % 3]]).norm();
        }
    }
    return mesh.triangles.empty() ? 0.0 : sum / static_cast<double>(3 * mesh.triangles.size());
}

}  // namespace ellicast::common
