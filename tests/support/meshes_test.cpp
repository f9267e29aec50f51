// tests/support/meshes_test.cpp: the shapes that other tests rely on, counted here without the
// library.
#include "tests/support/meshes.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

namespace ellicast::tests {
namespace {

using common::TriangleMesh;

struct Census {
    long euler = 0;
    std::size_t open_edges = 0;      // a directed edge without its opposite
    std::size_t repeated_edges = 0;  // a directed edge used twice
    double volume = 0;
};

Census census(const TriangleMesh& mesh) {
    std::map<std::pair<unsigned, unsigned>, int> directed;
    std::set<std::pair<unsigned, unsigned>> edges;
    std::set<unsigned> vertices;
    Census result;
    for (const common::Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) {
            REQUIRE(t[c] < mesh.positions.size());
            ++directed[{t[c], t[(c + 1) % 3]}];
            edges.insert(std::minmax(t[c], t[(c + 1) % 3]));
            vertices.insert(t[c]);
        }
        result.volume +=
            mesh.positions[t[0]].dot(mesh.positions[t[1]].cross(mesh.positions[t[2]])) / 6.0;
    }
    for (const auto& [edge, uses] : directed) {
        if (uses > 1) ++result.repeated_edges;
        if (!directed.count({edge.second, edge.first})) ++result.open_edges;
    }
    result.euler = static_cast<long>(vertices.size()) - static_cast<long>(edges.size()) +
                   static_cast<long>(mesh.triangles.size());
    return result;
}

void check_closed(const TriangleMesh& mesh, long euler, double volume, double tolerance) {
    const Census c = census(mesh);
    CHECK(c.open_edges == 0);
    CHECK(c.repeated_edges == 0);
    CHECK(c.euler == euler);
    CHECK(std::abs(c.volume - volume) <= tolerance * volume);
}

TEST_CASE("closed shapes are closed, outward and have their genus and volume") {
    const double pi = std::numbers::pi;
    check_closed(cube(2.0), 2, 8.0, 1e-12);
    CHECK(cube().positions.size() == 8);
    check_closed(box({1, 2, 3}, 4), 2, 6.0, 1e-12);
    CHECK(box({1, 2, 3}, 4).positions.size() == 6 * 16 + 2);
    check_closed(icosphere(4, 2.0), 2, 4.0 / 3.0 * pi * 8.0, 0.01);
    CHECK(icosphere(3).positions.size() == 642);
    check_closed(torus(1.0, 0.3, 64, 48), 0, 2 * pi * pi * 0.09, 0.01);
    check_closed(double_torus(1), -2, 13.0, 1e-12);
    check_closed(double_torus(3), -2, 13.0, 1e-12);
}

TEST_CASE("the zoo has the faults it is kept for") {
    CHECK(census(open_hemisphere(3)).open_edges == 32);
    CHECK(census(open_hemisphere(3)).euler == 1);
    CHECK(census(moebius_strip(12)).euler == 0);
    CHECK(census(moebius_strip(12)).repeated_edges > 0);
    check_closed(two_parts(), 4, 4.0 / 3.0 * std::numbers::pi * 1.125, 0.1);
    check_closed(overlapping_parts(), 4, 8.0 / 3.0 * std::numbers::pi, 0.1);
    check_closed(nested_shells(), 4, 4.0 / 3.0 * std::numbers::pi * 0.875, 0.1);
    CHECK(edge_shared_by_four().positions.size() == 14);
    CHECK(census(edge_shared_by_four()).repeated_edges == 2);
    CHECK(census(edge_touching_itself()).repeated_edges == 2);
    CHECK(census(edge_touching_itself()).volume == Approx(10.0));
    CHECK(vertex_shared_by_two().positions.size() == 15);
    check_closed(vertex_shared_by_two(), 3, 2.0, 1e-12);
    CHECK(with_degenerates().triangles.size() == 18);
    CHECK(census(inconsistent_orientation()).repeated_edges > 0);
}

}  // namespace
}  // namespace ellicast::tests
