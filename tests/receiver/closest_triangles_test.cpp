#include "receiver/closest_triangles.hpp"

#include <catch2/catch.hpp>
#include <cstddef>
#include <vector>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

TEST_CASE("every point is told its closest triangle once, on any number of threads") {
    const common::TriangleMesh mesh = tests::torus(1.0, 0.4, 60, 30);
    common::Random random(7);
    std::vector<Vector3d> points;
    for (int n = 0; n < 3'000; ++n) {
        points.emplace_back(3 * random.uniform() - 1.5, 3 * random.uniform() - 1.5,
                            random.uniform() - 0.5);
    }
    points.push_back(mesh.positions[17]);  // as near to one triangle as to its neighbours
    const common::TriangleTree tree(mesh);
    for (const unsigned threads : {1U, 3U}) {
        std::vector<int> visits(points.size(), 0);
        std::vector<common::TriangleTree::Hit> hits(points.size());
        visit_closest_triangles(
            mesh, points, threads,
            [&](std::uint32_t last, const Vector3d& x) {
                return squared_distance_to(mesh, last, x);
            },
            [&](std::size_t, std::size_t i, const common::TriangleTree::Hit& hit) {
                ++visits[i];
                hits[i] = hit;
            });
        for (std::size_t i = 0; i < points.size(); ++i) {
            const common::TriangleTree::Hit expected = tree.closest(points[i]);
            REQUIRE(visits[i] == 1);
            REQUIRE(hits[i].triangle == expected.triangle);
            REQUIRE(hits[i].point == expected.point);
        }
    }
}

}  // namespace
}  // namespace ellicast::receiver
