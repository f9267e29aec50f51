// sender/surface_samples.cpp
#include "sender/surface_samples.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace ellicast::sender {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

Vector3d unit_or_zero(const Vector3d& v) {
    const double length = v.norm();
    if (!(length > 0.0)) return Vector3d::Zero();
    return v / length;
}

// Twice the area, along the outward normal.
Vector3d area_vector(const TriangleMesh& mesh, const Triangle& t) {
    const Vector3d& a = mesh.positions[t[0]];
    return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
}

// Squared length of the side opposite each corner.
std::array<double, 3> squared_sides(const TriangleMesh& mesh, const Triangle& t) {
    const Vector3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    return {(b - c).squaredNorm(), (c - a).squaredNorm(), (a - b).squaredNorm()};
}

}  // namespace

std::vector<std::uint32_t> used_vertices(const TriangleMesh& mesh) {
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t corner : t) used[corner] = true;
    }
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        if (used[v]) vertices.push_back(v);
    }
    return vertices;
}

std::vector<Vector3d> inward_vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vector3d> sums(mesh.positions.size(), Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
        // [M99]: the area vector over the squared lengths of the corner's two sides, that is
        // sin(angle) /
        // (|u| |v|) times the normal. Exact on spheres, and no angle is computed.
        const Vector3d inward = -area_vector(mesh, t);
        const std::array<double, 3> opposite = squared_sides(mesh, t);
        for (std::size_t i = 0; i < 3; ++i) {
            const double weight = opposite[(i + 1) % 3] * opposite[(i + 2) % 3];
            if (weight > 0.0) sums[t[i]] += inward / weight;
        }
    }
    for (Vector3d& sum : sums) sum = unit_or_zero(sum);
    return sums;
}

SurfaceSamples random_surface_points(const TriangleMesh& mesh, std::size_t count,
                                     common::Random& random) {
    SurfaceSamples samples;
    double total = 0.0;
    for (const Triangle& t : mesh.triangles) total += area_vector(mesh, t).norm();
    if (!(total > 0.0) || count == 0) return samples;
    const double share = total / static_cast<double>(count);
    double before = 0.0;
    double target = share * random.uniform();
    for (const Triangle& t : mesh.triangles) {
        const Vector3d doubled = area_vector(mesh, t);
        const double after = before + doubled.norm();
        while (samples.points.size() < count && target < after) {
            // Uniform in the triangle: the square root keeps area, not length, proportional.
            const double root = std::sqrt(random.uniform());
            const double v = random.uniform();
            samples.points.push_back((1.0 - root) * mesh.positions[t[0]] +
                                     root * (1.0 - v) * mesh.positions[t[1]] +
                                     root * v * mesh.positions[t[2]]);
            samples.inward.push_back(unit_or_zero(-doubled));
            target = share * (static_cast<double>(samples.points.size()) + random.uniform());
        }
        before = after;
    }
    return samples;
}

SurfaceSamples place_seeds(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<std::uint32_t> vertices = used_vertices(mesh);
    common::shuffle(vertices, random);
    vertices.resize(std::min(vertices.size(), count / 2));
    const std::vector<Vector3d> normals = inward_vertex_normals(mesh);
    SurfaceSamples seeds;
    for (const std::uint32_t v : vertices) {
        if (normals[v].isZero()) continue;
        seeds.points.push_back(mesh.positions[v]);
        seeds.inward.push_back(normals[v]);
    }
    const SurfaceSamples by_area = random_surface_points(mesh, count - seeds.points.size(), random);
    for (std::size_t i = 0; i < by_area.points.size(); ++i) {
        if (by_area.inward[i].isZero()) continue;
        seeds.points.push_back(by_area.points[i]);
        seeds.inward.push_back(by_area.inward[i]);
    }
    return seeds;
}

}  // namespace ellicast::sender
