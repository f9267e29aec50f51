// tests/support/rivals.cpp
#include "tests/support/rivals.hpp"

#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace ellicast::tests {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

// Whether some four of the points are not in one plane: what a Delaunay triangulation in space
// needs.
bool span_volume(const std::vector<Kernel::Point_3>& points) {
    const auto first = [&](const auto& holds) {
        return std::find_if(points.begin(), points.end(), holds);
    };
    if (points.empty()) return false;
    const Kernel::Point_3& a = points.front();
    const auto b = first([&](const auto& p) { return p != a; });
    if (b == points.end()) return false;
    const auto c = first([&](const auto& p) { return !CGAL::collinear(a, *b, p); });
    if (c == points.end()) return false;
    return first([&](const auto& p) { return !CGAL::coplanar(a, *b, *c, p); }) != points.end();
}

}  // namespace

common::TriangleMesh advancing_front(const std::vector<Eigen::Vector3d>& points) {
    common::TriangleMesh mesh;
    mesh.positions = points;
    std::vector<Kernel::Point_3> input;
    input.reserve(points.size());
    for (const Eigen::Vector3d& p : points) input.emplace_back(p[0], p[1], p[2]);
    if (!span_volume(input)) return mesh;
    std::vector<std::array<std::size_t, 3>> faces;
    CGAL::advancing_front_surface_reconstruction(input.begin(), input.end(),
                                                 std::back_inserter(faces));
    mesh.triangles.reserve(faces.size());
    for (const auto& [a, b, c] : faces) {
        mesh.triangles.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                                  static_cast<std::uint32_t>(c)});
    }
    return mesh;
}

std::size_t positions_used(const common::TriangleMesh& mesh) {
    std::vector<bool> used(mesh.positions.size(), false);
    for (const common::Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) used[v] = true;
    }
    return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
}

}  // namespace ellicast::tests
