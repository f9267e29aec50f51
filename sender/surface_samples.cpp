// sender/surface_samples.cpp
#include "sender/surface_samples.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <iterator>

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

Vector3d inward_normal(const TriangleMesh& mesh, const Triangle& t) {
    return unit_or_zero(-area_vector(mesh, t));
}

double edge_length(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) {
    return (mesh.positions[a] - mesh.positions[b]).norm();
}

// Squared length of the side opposite each corner.
std::array<double, 3> squared_sides(const TriangleMesh& mesh, const Triangle& t) {
    const Vector3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    return {(b - c).squaredNorm(), (c - a).squaredNorm(), (a - b).squaredNorm()};
}

int parts_of(double length, double spacing) {
    return std::max(1, static_cast<int>(std::ceil(length / spacing)));
}

void add_vertices(const TriangleMesh& mesh, SurfaceSamples& samples) {
    const std::vector<Vector3d> normals = inward_vertex_normals(mesh);
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t corner : t) used[corner] = true;
    }
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        if (!used[v]) continue;
        samples.points.push_back({{v, v, v}, Vector3d(1.0, 0.0, 0.0)});
        samples.inward.push_back(normals[v]);
    }
}

// A side of a triangle, low index first.
struct Side {
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    std::uint32_t triangle = 0;

    [[nodiscard]] bool same_edge(const Side& other) const {
        return low == other.low && high == other.high;
    }
};

std::vector<Side> long_sides(const TriangleMesh& mesh, double spacing) {
    std::vector<Side> sides;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        const Triangle& t = mesh.triangles[f];
        for (std::size_t i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(t[i], t[(i + 1) % 3]);
            if ((mesh.positions[low] - mesh.positions[high]).squaredNorm() > spacing * spacing) {
                sides.push_back({low, high, f});
            }
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        if (a.low != b.low) return a.low < b.low;
        if (a.high != b.high) return a.high < b.high;
        return a.triangle < b.triangle;
    });
    return sides;
}

void add_edges(const TriangleMesh& mesh, double spacing, SurfaceSamples& samples) {
    const std::vector<Side> sides = long_sides(mesh, spacing);
    for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
        const Side& edge = sides[first];
        Vector3d sum = Vector3d::Zero();
        for (last = first; last < sides.size() && sides[last].same_edge(edge); ++last) {
            sum += inward_normal(mesh, mesh.triangles[sides[last].triangle]);
        }
        const Vector3d inward = unit_or_zero(sum);
        const int parts = parts_of(edge_length(mesh, edge.low, edge.high), spacing);
        for (int k = 1; k < parts; ++k) {
            const double s = static_cast<double>(k) / parts;
            samples.points.push_back({{edge.low, edge.high, edge.high}, {1.0 - s, s, 0.0}});
            samples.inward.push_back(inward);
        }
    }
}

// Rows parallel to the longest edge ab, between it and the opposite corner c.
void add_interior(const TriangleMesh& mesh, const Triangle& t, double spacing,
                  SurfaceSamples& samples) {
    const std::array<double, 3> sides = squared_sides(mesh, t);
    const auto top = static_cast<std::size_t>(
        std::distance(sides.begin(), std::max_element(sides.begin(), sides.end())));
    if (!(sides[top] > spacing * spacing)) return;
    const std::uint32_t a = t[(top + 1) % 3], b = t[(top + 2) % 3], c = t[top];
    const double base = std::sqrt(sides[top]);
    const double height = area_vector(mesh, t).norm() / base;
    const int rows = parts_of(height, spacing);
    const Vector3d inward = inward_normal(mesh, t);
    for (int row = 1; row < rows; ++row) {
        const double towards_c = static_cast<double>(row) / rows;
        const int parts = parts_of(base * (1.0 - towards_c), spacing);
        for (int k = 1; k < parts; ++k) {
            const double s = (1.0 - towards_c) * k / parts;
            samples.points.push_back({{a, b, c}, {1.0 - towards_c - s, s, towards_c}});
            samples.inward.push_back(inward);
        }
    }
}

}  // namespace

std::vector<Vector3d> inward_vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vector3d> sums(mesh.positions.size(), Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
        // [M99]: the area vector over the squared lengths of the corner's two sides, that is
        // sin(angle) / (|u| |v|) times the normal. Exact on spheres, and no angle is computed.
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

SurfaceSamples sample_surface(const TriangleMesh& mesh, double spacing) {
    assert(spacing > 0.0);
    SurfaceSamples samples;
    samples.points.reserve(mesh.positions.size());
    samples.inward.reserve(mesh.positions.size());
    add_vertices(mesh, samples);
    add_edges(mesh, spacing, samples);
    for (const Triangle& t : mesh.triangles) add_interior(mesh, t, spacing, samples);
    return samples;
}

double default_sample_spacing(const TriangleMesh& mesh) {
    constexpr double kLongEdge =
        0.05;  // of the diagonal: longer than any edge of the reference scans
    double large = 0.0, all = 0.0;
    for (const Triangle& t : mesh.triangles) {
        const double area = area_vector(mesh, t).norm();
        const std::array<double, 3> sides = squared_sides(mesh, t);
        all += area;
        if (*std::max_element(sides.begin(), sides.end()) > kLongEdge * kLongEdge) large += area;
    }
    return large > 0.2 * all ? 0.01 : 0.02;
}

SurfaceSamples random_surface_points(const TriangleMesh& mesh, std::size_t count,
                                     common::Random& random) {
    SurfaceSamples samples;
    double total = 0.0;
    for (const Triangle& t : mesh.triangles) total += area_vector(mesh, t).norm();
    if (!(total > 0.0)) return samples;
    double before = 0.0;
    std::size_t k = 0;
    double target = total * random.uniform() / static_cast<double>(count);
    for (const Triangle& t : mesh.triangles) {
        const Vector3d doubled = area_vector(mesh, t);
        const double after = before + doubled.norm();
        while (k < count && target < after) {
            // Uniform in the triangle: the square root keeps area, not length, proportional.
            const double root = std::sqrt(random.uniform());
            const double v = random.uniform();
            samples.points.push_back(
                {{t[0], t[1], t[2]}, {1.0 - root, root * (1.0 - v), root * v}});
            samples.inward.push_back(unit_or_zero(-doubled));
            ++k;
            target =
                total * (static_cast<double>(k) + random.uniform()) / static_cast<double>(count);
        }
        before = after;
    }
    return samples;
}

}  // namespace ellicast::sender
