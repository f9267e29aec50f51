// sender/decimated_mesh.cpp
#include "sender/decimated_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/morton_order.hpp"

namespace ellicast::sender {

using Eigen::Vector3d;

DecimatedMesh::DecimatedMesh(const common::TriangleMesh& surface)
    : label(common::morton_order(surface.positions)), removed(label.size(), 0) {
    place_vertices(surface);
    link_triangles(surface);
    add_quadrics();
    witness_of.assign(triangles.size(), kNone);
    next_witness.assign(label.size(), kNone);
    squared_distance.assign(label.size(), 0.0f);
}

void DecimatedMesh::place_vertices(const common::TriangleMesh& surface) {
    const Eigen::AlignedBox3d box = common::bounding_box(surface.positions);
    const double size = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
    const double scale = size > 0.0 && std::isfinite(size) ? 1.0 / size : 0.0;
    positions.reserve(label.size());
    for (const std::uint32_t index : label) {
        positions.push_back((surface.positions[index] - box.min()) * scale);
    }
}

void DecimatedMesh::link_triangles(const common::TriangleMesh& surface) {
    std::vector<std::uint32_t> vertex_of(label.size());
    for (std::uint32_t v = 0; v < label.size(); ++v) vertex_of[label[v]] = v;
    std::vector<common::Triangle> renamed;
    renamed.reserve(surface.triangles.size());
    for (const common::Triangle& t : surface.triangles) {
        const common::Triangle here{vertex_of[t[0]], vertex_of[t[1]], vertex_of[t[2]]};
        if (here[0] != here[1] && here[1] != here[2] && here[2] != here[0]) {
            renamed.push_back(here);
        }
    }
    const Buckets along_curve(renamed.size(), label.size(), [&](std::size_t t) {
        return *std::min_element(renamed[t].begin(), renamed[t].end());
    });
    triangles.reserve(renamed.size());
    for (const std::uint32_t t : along_curve.items) triangles.push_back(renamed[t]);

    first_corner.assign(label.size(), kNone);
    next_corner.resize(3 * triangles.size());
    for (std::size_t h = next_corner.size(); h-- > 0;) {
        const std::uint32_t v = origin(triangles, static_cast<HalfEdge>(h));
        next_corner[h] = first_corner[v];
        first_corner[v] = static_cast<HalfEdge>(h);
    }
}

void DecimatedMesh::add_quadrics() {
    quadrics.resize(label.size());
    for (const common::Triangle& t : triangles) {
        const Vector3d& a = positions[t[0]];
        const Vector3d n = (positions[t[1]] - a).cross(positions[t[2]] - a);
        const double twice_area = n.norm();
        if (!(twice_area > 0.0)) continue;
        // A third of the triangle for each corner, so that the sum over the vertices is the
        // surface.
        for (const std::uint32_t v : t) quadrics[v].add_plane(n / twice_area, twice_area / 6.0);
    }
    witnessed.reserve(label.size());
    for (const Quadric& Q : quadrics) witnessed.push_back(Q.area);
}

}  // namespace ellicast::sender
