// common/vertex_normals.cpp
#include "common/vertex_normals.hpp"

#include <cstddef>

namespace ellicast::common {

using Eigen::Vector3d;

std::vector<Vector3d> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vector3d> normals(mesh.positions.size(), Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Vector3d u = mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]];
            const Vector3d v = mesh.positions[t[(k + 2) % 3]] - mesh.positions[t[k]];
            normals[t[k]] += corner_normal(u, v);
        }
    }
    for (Vector3d& n : normals) n.normalize();
    return normals;
}

}  // namespace ellicast::common
