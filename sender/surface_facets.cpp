// sender/surface_facets.cpp
#include "sender/surface_facets.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace ellicast::sender {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

Vector3d outward_normal(const TriangleMesh& mesh, const Triangle& t) {
    const Vector3d& a = mesh.positions[t[0]];
    const Vector3d n = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
    const double length = n.norm();
    if (!(length > 0.0)) return Vector3d::Zero();
    return n / length;
}

// Side i of a triangle runs from corner i to the next; the edge is named by its ends, low first.
struct Side {
    std::uint32_t low = 0, high = 0;
    std::uint32_t triangle = 0;
    std::uint32_t corner = 0;  // i
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh, const std::vector<bool>& wanted_vertex) {
    std::vector<Side> sides;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        const Triangle& t = mesh.triangles[f];
        for (std::uint32_t i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(t[i], t[(i + 1) % 3]);
            if (wanted_vertex[low] && wanted_vertex[high]) sides.push_back({low, high, f, i});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        if (a.low != b.low) return a.low < b.low;
        if (a.high != b.high) return a.high < b.high;
        return a.triangle < b.triangle;
    });
    return sides;
}

// Sagitta of `side`'s triangle over the edge that it shares with `other`'s.
double sagitta(const TriangleMesh& mesh, const Side& side, const Side& other) {
    constexpr double kCrease = 40.0 * std::numbers::pi / 180.0;
    const Triangle& t = mesh.triangles[side.triangle];
    const Vector3d n = outward_normal(mesh, t);
    const Vector3d m = outward_normal(mesh, mesh.triangles[other.triangle]);
    const Vector3d along =
        mesh.positions[t[(side.corner + 1) % 3]] - mesh.positions[t[side.corner]];
    const double turn = std::atan2(n.cross(m).dot(along.normalized()), n.dot(m));
    if (!(turn > 0.0 && turn < kCrease)) return 0.0;  // concave, flat or crease
    const Vector3d to_top =
        mesh.positions[t[(side.corner + 2) % 3]] - mesh.positions[t[side.corner]];
    const double height = to_top.cross(along).norm() / along.norm();
    return 0.5 * height * std::tan(0.25 * turn);
}

}  // namespace

std::vector<std::uint32_t> large_triangles(const TriangleMesh& mesh, double length) {
    std::vector<std::uint32_t> large;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        const Triangle& t = mesh.triangles[f];
        double longest = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            longest = std::max(
                longest, (mesh.positions[t[i]] - mesh.positions[t[(i + 1) % 3]]).squaredNorm());
        }
        if (longest > length * length) large.push_back(f);
    }
    return large;
}

std::vector<Corners> offset_triangles(const TriangleMesh& mesh,
                                      const std::vector<std::uint32_t>& which, double largest) {
    std::vector<bool> wanted(mesh.positions.size(), false);
    for (const std::uint32_t f : which) {
        for (const std::uint32_t corner : mesh.triangles[f]) wanted[corner] = true;
    }
    std::vector<double> offset(mesh.triangles.size(), 0.0);
    const std::vector<Side> sides = sorted_sides(mesh, wanted);
    for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
        const Side &a = sides[i], &b = sides[i + 1];
        if (a.low != b.low || a.high != b.high) continue;
        offset[a.triangle] = std::max(offset[a.triangle], sagitta(mesh, a, b));
        offset[b.triangle] = std::max(offset[b.triangle], sagitta(mesh, b, a));
    }
    std::vector<Corners> triangles;
    triangles.reserve(which.size());
    for (const std::uint32_t f : which) {
        const Triangle& t = mesh.triangles[f];
        const Vector3d by = std::min(offset[f], largest) * outward_normal(mesh, t);
        triangles.push_back(
            {mesh.positions[t[0]] + by, mesh.positions[t[1]] + by, mesh.positions[t[2]] + by});
    }
    return triangles;
}

}  // namespace ellicast::sender
