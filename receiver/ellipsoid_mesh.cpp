// receiver/ellipsoid_mesh.cpp
#include "receiver/ellipsoid_mesh.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <utility>

namespace ellicast::receiver {
namespace {

common::TriangleMesh subdivided(const common::TriangleMesh& mesh) {
    common::TriangleMesh result;
    result.positions = mesh.positions;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoints;
    const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
        const auto next = static_cast<std::uint32_t>(result.positions.size());
        const auto [it, is_new] = midpoints.try_emplace(std::minmax(a, b), next);
        if (is_new) {
            const Eigen::Vector3d sum = result.positions[a] + result.positions[b];
            result.positions.emplace_back(sum.normalized());
        }
        return it->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
        const std::uint32_t ab = midpoint(a, b);
        const std::uint32_t bc = midpoint(b, c);
        const std::uint32_t ca = midpoint(c, a);
        result.triangles.push_back({a, ab, ca});
        result.triangles.push_back({ab, b, bc});
        result.triangles.push_back({ca, bc, c});
        result.triangles.push_back({ab, bc, ca});
    }
    return result;
}

common::TriangleMesh unit_sphere() {
    common::TriangleMesh octahedron;
    octahedron.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                            {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return subdivided(subdivided(octahedron));
}

}  // namespace

common::TriangleMesh mesh_of(std::span<const common::Ellipsoid> ellipsoids) {
    const common::TriangleMesh sphere = unit_sphere();
    common::TriangleMesh result;
    for (const common::Ellipsoid& ellipsoid : ellipsoids) {
        const auto base = static_cast<std::uint32_t>(result.positions.size());
        for (const Eigen::Vector3d& u : sphere.positions) {
            result.positions.emplace_back(ellipsoid.center + ellipsoid.L * u);
        }
        for (const auto& [a, b, c] : sphere.triangles) {
            result.triangles.push_back({base + a, base + b, base + c});
        }
    }
    return result;
}

}  // namespace ellicast::receiver
