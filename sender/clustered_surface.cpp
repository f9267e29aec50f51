// sender/clustered_surface.cpp
#include "sender/clustered_surface.hpp"

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sender/edge_table.hpp"
#include "sender/equal_positions.hpp"

namespace ellicast::sender {

common::TriangleMesh clustered_surface(const common::TriangleMesh& mesh, double size) {
    assert(size > 0.0);
    const std::vector<std::uint32_t> first =
        first_equals(mesh.positions.size(), [&](std::size_t v) {
            const Eigen::Vector3d& p = mesh.positions[v];
            return std::array<double, 3>{std::floor(p.x() / size), std::floor(p.y() / size),
                                         std::floor(p.z() / size)};
        });
    common::TriangleMesh result;
    std::vector<std::uint32_t> renamed(mesh.positions.size(), kNone);
    for (const common::Triangle& t : mesh.triangles) {
        common::Triangle corners{first[t[0]], first[t[1]], first[t[2]]};
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
            continue;
        }
        for (std::uint32_t& v : corners) {
            if (renamed[v] == kNone) {
                renamed[v] = static_cast<std::uint32_t>(result.positions.size());
                result.positions.push_back(mesh.positions[v]);
            }
            v = renamed[v];
        }
        result.triangles.push_back(corners);
    }
    return result;
}

}  // namespace ellicast::sender
