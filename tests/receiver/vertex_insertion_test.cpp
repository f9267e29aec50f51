// tests/receiver/vertex_insertion_test.cpp
#include "receiver/vertex_insertion.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <numeric>
#include <set>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "receiver/edge_flips.hpp"
#include "receiver/surface_smoothing.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

PointSurface start_from(const common::TriangleMesh& mesh) {
    std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    REQUIRE(surface);
    const std::size_t vertices = surface->vertex_slots();
    return {std::move(*surface), std::vector<std::uint32_t>(vertices, kNone)};
}

std::vector<Vector3d> sphere_points(std::size_t n, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<Vector3d> points;
    while (points.size() < n) {
        const Vector3d p(random.uniform() * 2 - 1, random.uniform() * 2 - 1,
                         random.uniform() * 2 - 1);
        if (p.norm() > 0.1 && p.norm() < 1.0) points.push_back(p.normalized());
    }
    return points;
}

std::vector<std::uint32_t> all_of(std::size_t n) {
    std::vector<std::uint32_t> indices(n);
    std::iota(indices.begin(), indices.end(), 0U);
    return indices;
}

// Each point not left out is exactly one live vertex.
void require_each_point_once(const PointSurface& surface, std::size_t points,
                             const std::vector<std::uint32_t>& left_out) {
    REQUIRE(surface.point_of_vertex.size() == surface.mesh.vertex_slots());
    std::vector<int> seen(points, 0);
    for (VertexId v = 0; v < surface.mesh.vertex_slots(); ++v) {
        if (surface.point_of_vertex[v] != kNone) ++seen[surface.point_of_vertex[v]];
    }
    for (const std::uint32_t p : left_out) ++seen[p];
    REQUIRE(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
}

TEST_CASE("every point becomes a vertex, and the surface stays a sphere") {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        INFO("seed " << seed);
        const std::vector<Vector3d> points = sphere_points(3000, seed);
        PointSurface surface = start_from(tests::icosphere(2, 0.97));
        const auto left_out = insert_points(surface, points, all_of(points.size()), 2);
        REQUIRE(left_out.size() <= 1);
        REQUIRE(surface.mesh.validate().empty());
        require_each_point_once(surface, points.size(), left_out);
        shift_to_points(surface, points);
        flip_all_to_delaunay(surface.mesh);
        flip_to_smooth(surface.mesh);
        const common::TriangleMesh mesh = surface.mesh.extract();
        REQUIRE(common::analyse_topology(mesh).euler == 2);
        // Outward: needles of three points close to one great circle may stand as they like,
        // nothing else.
        double turned = 0.0;
        for (const auto& [a, b, c] : mesh.triangles) {
            const Vector3d n = (mesh.positions[b] - mesh.positions[a])
                                   .cross(mesh.positions[c] - mesh.positions[a]);
            const Vector3d out = mesh.positions[a] + mesh.positions[b] + mesh.positions[c];
            if (n.dot(out) <= 0) turned += 0.5 * n.norm();
        }
        REQUIRE(turned < 0.025);  // of 12.6
    }
}

TEST_CASE("points on vertices, on edges and twice at one place do no harm") {
    const common::TriangleMesh base = tests::icosphere(1);
    std::vector<Vector3d> points = base.positions;  // on every vertex
    for (const auto& [a, b, c] : base.triangles) {  // on every edge, once per face: twice in all
        points.emplace_back(0.5 * (base.positions[a] + base.positions[b]));
    }
    points.push_back(points.back());
    PointSurface surface = start_from(base);
    const auto left_out = insert_points(surface, points, all_of(points.size()), 1);
    REQUIRE(surface.mesh.validate().empty());
    require_each_point_once(surface, points.size(), left_out);
    // What is left out are the further copies of a place, and nothing else.
    std::set<std::array<double, 3>> places;
    for (const Vector3d& p : points) places.insert({p.x(), p.y(), p.z()});
    REQUIRE(points.size() - left_out.size() == places.size());
}

TEST_CASE("the order of the chosen points and the number of threads do not matter") {
    const std::vector<Vector3d> points = sphere_points(800, 9);
    std::vector<std::uint32_t> chosen = all_of(points.size());
    PointSurface one = start_from(tests::icosphere(2, 0.95));
    const auto left_one = insert_points(one, points, chosen, 1);
    common::Random random(4);
    common::shuffle(chosen, random);
    PointSurface two = start_from(tests::icosphere(2, 0.95));
    REQUIRE(insert_points(two, points, chosen, 3) == left_one);
    REQUIRE(one.point_of_vertex == two.point_of_vertex);
    REQUIRE(one.mesh.extract().triangles == two.mesh.extract().triangles);
    REQUIRE(one.mesh.extract().positions == two.mesh.extract().positions);
}

TEST_CASE("points go in on several threads as on one, where the surface is large enough for that") {
    const std::vector<Vector3d> points = sphere_points(60'000, 9);
    const common::TriangleMesh base = tests::icosphere(6, 0.95);  // 81 920 faces
    PointSurface one = start_from(base);
    const auto left_one = insert_points(one, points, all_of(points.size()), 1);
    REQUIRE(one.mesh.validate().empty());
    require_each_point_once(one, points.size(), left_one);
    PointSurface two = start_from(base);
    REQUIRE(insert_points(two, points, all_of(points.size()), 3) == left_one);
    REQUIRE(one.point_of_vertex == two.point_of_vertex);
    REQUIRE(one.mesh.extract().triangles == two.mesh.extract().triangles);
    // What one region did not need is another's.
    REQUIRE(one.mesh.vertex_slots() == base.positions.size() + points.size());
    // All edges that were put off have been looked at.
    REQUIRE(flip_all_to_delaunay(one.mesh) * 1000 < points.size());
    REQUIRE(common::analyse_topology(one.mesh.extract()).euler == 2);
}

TEST_CASE("far-away points leave a closed manifold") {
    common::Random random(2);
    std::vector<Vector3d> points;
    for (int n = 0; n < 500; ++n) {
        points.emplace_back(random.uniform() * 20 - 10, random.uniform() * 20 - 10,
                            random.uniform() * 20 - 10);
    }
    PointSurface surface = start_from(tests::torus(1, 0.4, 16, 10));
    const auto left_out = insert_points(surface, points, all_of(points.size()), 2);
    require_each_point_once(surface, points.size(), left_out);
    shift_to_points(surface, points);
    REQUIRE(surface.mesh.validate().empty());
    REQUIRE(common::analyse_topology(surface.mesh.extract()).euler == 0);
}

}  // namespace
}  // namespace ellicast::receiver
