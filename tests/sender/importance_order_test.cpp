// tests/sender/importance_order_test.cpp
#include "sender/importance_order.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "sender/broadcast_object.hpp"
#include "sender/range_decimation.hpp"
#include "sender/spread_order.hpp"
#include "sender/surface_decimation.hpp"
#include "sender/vertex_queue.hpp"
#include "tests/sender/made_objects.hpp"
#include "tests/support/large_model.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;

bool is_permutation_of(std::vector<std::uint32_t> order, std::size_t count) {
    std::sort(order.begin(), order.end());
    for (std::size_t k = 0; k < order.size(); ++k) {
        if (order[k] != k) return false;
    }
    return order.size() == count;
}

/// A plate with a small bump on it: all that matters is in one place.
TriangleMesh plate_with_bump() {
    TriangleMesh mesh = tests::box(Vector3d(2.0, 2.0, 0.5), 48);
    for (Vector3d& p : mesh.positions) {
        const double from_axis2 = p[0] * p[0] + p[1] * p[1];
        if (p[2] > 0.24 && from_axis2 < 0.16) p[2] += std::sqrt(0.16 - from_axis2);
    }
    return mesh;
}

/// rms distance of the surface collapsed onto the first vertices of an order, as a share.
double prefix_error(const TriangleMesh& surface, const std::vector<std::uint32_t>& order,
                    double share) {
    std::vector<bool> keep(surface.positions.size(), false);
    const auto count = static_cast<std::size_t>(share * static_cast<double>(order.size()));
    for (std::size_t k = 0; k < count; ++k) keep[order[k]] = true;
    common::MeshDistanceOptions options;
    options.samples = 20'000;
    return common::measure_distance(collapsed_onto(surface, keep), surface, options).rms();
}

std::vector<std::uint32_t> importance_of(const TriangleMesh& surface) {
    std::vector<std::uint32_t> ranking = removal_order(surface);
    std::reverse(ranking.begin(), ranking.end());
    std::vector<Vector3d> positions;
    positions.reserve(ranking.size());
    for (const std::uint32_t index : ranking) positions.push_back(surface.positions[index]);
    std::vector<std::uint32_t> order;
    for (const std::uint32_t k : spread_within_strata(positions, 1)) order.push_back(ranking[k]);
    return order;
}

TriangleMesh soup(std::size_t vertices, std::size_t triangles, std::uint64_t seed) {
    common::Random random(seed);
    TriangleMesh mesh;
    mesh.positions = tests::sphere_points(vertices, seed);
    for (std::size_t k = 0; k < triangles; ++k) {
        common::Triangle t{};
        for (std::uint32_t& corner : t) corner = static_cast<std::uint32_t>(random.below(vertices));
        mesh.triangles.push_back(t);
    }
    return mesh;
}

}  // namespace

TEST_CASE("what a decimation of a box removes last are its corners") {
    const TriangleMesh box = tests::box(Vector3d(1.0, 2.0, 3.0), 7);
    const std::vector<std::uint32_t> removed = removal_order(box);
    REQUIRE(is_permutation_of(removed, box.positions.size()));
    for (auto last = removed.end() - 8; last != removed.end(); ++last) {
        const Vector3d p = box.positions[*last].cwiseAbs();
        CHECK((p - Vector3d(0.5, 1.0, 1.5)).norm() < 1e-12);
    }
}

TEST_CASE("any triangles have an order, and always the same one") {
    TriangleMesh points;
    points.positions = tests::sphere_points(300, 3);
    TriangleMesh one_place = tests::icosphere(2);
    for (Vector3d& p : one_place.positions) p = Vector3d(1.0, 2.0, 3.0);
    TriangleMesh line = tests::icosphere(2);
    for (Vector3d& p : line.positions) p = Vector3d(p[0], 0.0, 0.0);
    TriangleMesh huge = tests::icosphere(1);
    for (Vector3d& p : huge.positions) p *= 1e300;
    const TriangleMesh two{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {2, 1, 3}}};
    const TriangleMesh back_to_back{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 1, 0}}};
    const TriangleMesh repeated{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 1, 1}}};
    const TriangleMesh tetrahedra =
        tests::join(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}},
                    points);
    for (const TriangleMesh& mesh : {TriangleMesh{},
                                     points,
                                     one_place,
                                     line,
                                     huge,
                                     two,
                                     back_to_back,
                                     repeated,
                                     tetrahedra,
                                     tests::cube(),
                                     tests::open_hemisphere(3),
                                     tests::moebius_strip(20),
                                     tests::two_parts(),
                                     tests::overlapping_parts(),
                                     tests::nested_shells(),
                                     tests::edge_shared_by_four(),
                                     tests::vertex_shared_by_two(),
                                     tests::with_degenerates(),
                                     tests::inconsistent_orientation(),
                                     soup(50, 400, 1),
                                     soup(200, 300, 2),
                                     soup(5, 1000, 3)}) {
        const std::vector<std::uint32_t> order = removal_order(mesh);
        CAPTURE(mesh.positions.size(), mesh.triangles.size());
        CHECK(is_permutation_of(order, mesh.positions.size()));
        CHECK(order == removal_order(mesh));
        CHECK_NOTHROW(collapsed_onto(mesh, std::vector<bool>(mesh.positions.size(), false)));
    }
}

TEST_CASE("a prefix in order of importance is nearer to the model than one in spread order") {
    const TriangleMesh surface = GENERATE(plate_with_bump(), tests::torus(1.0, 0.3, 96, 32));
    const std::vector<std::uint32_t> importance = importance_of(surface);
    const std::vector<std::uint32_t> spread = spread_order(surface.positions, 1);
    REQUIRE(is_permutation_of(importance, surface.positions.size()));
    for (const double share : {0.1, 0.25, 0.5}) {
        const double ours = prefix_error(surface, importance, share);
        const double theirs = prefix_error(surface, spread, share);
        CAPTURE(share, ours, theirs);
        CHECK(ours < 0.75 * theirs);
    }
}

TEST_CASE("a large surface is decimated in ranges, alike on any number of threads") {
    const TriangleMesh surface = tests::large_model(plate_with_bump(), 140'000, 1);
    const std::vector<std::uint32_t> removed = removal_order(surface, 1);
    REQUIRE(is_permutation_of(removed, surface.positions.size()));
    CHECK((removal_order(surface, 3) == removed));
    const std::vector<std::uint32_t> importance(removed.rbegin(), removed.rend());
    const std::vector<std::uint32_t> spread = spread_order(surface.positions, 1);
    for (const double share : {0.1, 0.5}) {
        const double ours = prefix_error(surface, importance, share);
        const double theirs = prefix_error(surface, spread, share);
        CAPTURE(share, ours, theirs);
        CHECK(ours < 0.5 * theirs);
    }
}

TEST_CASE("a range is decimated alone, but for its border") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 60, 24);
    const DecimatedMesh before(torus);
    DecimatedMesh mesh(torus);
    const std::uint32_t begin = 400;
    const std::uint32_t end = 1000;
    const auto outside = [&](std::uint32_t v) { return v < begin || v >= end; };
    std::vector<Removal> removals;
    RangeDecimation(mesh, begin, end).remove(Allowed::good_shape, 0, removals);
    CHECK(removals.size() > 200);
    for (const Removal& removal : removals) REQUIRE(!outside(removal.vertex));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const common::Triangle& corners = before.triangles[t];
        if (!std::any_of(corners.begin(), corners.end(), outside)) continue;
        REQUIRE(mesh.triangles[t] == corners);
        for (const std::uint32_t v : corners) REQUIRE(mesh.removed[v] == 0);
    }
    removals.clear();
    RangeDecimation(mesh, 0, 400).remove(Allowed::good_shape, 300, removals);
    CHECK(removals.size() == 100);
}

TEST_CASE("collapsing onto some vertices keeps them, their places and the topology") {
    const TriangleMesh torus = tests::torus(1.0, 0.3, 60, 24);
    std::vector<bool> keep(torus.positions.size(), false);
    const std::vector<std::uint32_t> order = spread_order(torus.positions, 1);
    for (std::size_t k = 0; k < order.size() / 4; ++k) keep[order[k]] = true;
    const TriangleMesh collapsed = collapsed_onto(torus, keep);
    CHECK(collapsed.positions == torus.positions);
    std::set<std::uint32_t> used;
    for (const common::Triangle& t : collapsed.triangles) used.insert(t.begin(), t.end());
    for (std::uint32_t v = 0; v < keep.size(); ++v) REQUIRE((!keep[v] || used.count(v) == 1));
    CHECK(used.size() < order.size() / 4 + 5);
    const common::MeshTopology topology = common::analyse_topology(collapsed);
    CHECK(topology.closed);
    CHECK(topology.manifold);
    CHECK(topology.euler == 0);
}

TEST_CASE("strata halve the vertices until few are left") {
    CHECK(importance_strata(0) == std::vector<std::uint32_t>{0});
    CHECK(importance_strata(1) == std::vector<std::uint32_t>{0, 1});
    CHECK(importance_strata(511) == std::vector<std::uint32_t>{0, 511});
    CHECK(importance_strata(512) == std::vector<std::uint32_t>{0, 256, 512});
    CHECK(importance_strata(4201) == std::vector<std::uint32_t>{0, 263, 526, 1051, 2101, 4201});
}

TEST_CASE("in a stratum the vertices are spread, and none leaves it") {
    const std::size_t count = GENERATE(0u, 1u, 600u, 5000u, 8192u);
    const std::vector<Vector3d> positions = tests::line_points(count);
    const std::vector<std::uint32_t> order = spread_within_strata(positions, 7);
    REQUIRE(is_permutation_of(order, count));
    CHECK(order == spread_within_strata(positions, 7));
    if (count > 100) CHECK(order != spread_within_strata(positions, 8));
    const std::vector<std::uint32_t> bounds = importance_strata(static_cast<std::uint32_t>(count));
    for (std::size_t s = 0; s + 1 < bounds.size(); ++s) {
        const std::uint32_t size = bounds[s + 1] - bounds[s];
        for (std::uint32_t k = bounds[s]; k < bounds[s + 1]; ++k) {
            REQUIRE(order[k] >= bounds[s]);
            REQUIRE(order[k] < bounds[s + 1]);
        }
        // Eight that follow each other at an odd stride lie in eight parts, but for borders.
        for (const std::uint32_t stride : {1u, 3u, 11u}) {
            for (std::uint32_t k = bounds[s]; k + 7 * stride < bounds[s + 1]; ++k) {
                std::set<double> parts;
                for (std::uint32_t j = 0; j < 8; ++j) {
                    const double x = positions[order[k + j * stride]][0];
                    const double low = positions[bounds[s]][0];
                    parts.insert(std::floor(8.0 * (x - low) / size));
                }
                REQUIRE(parts.size() >= 7);
            }
        }
    }
}

TEST_CASE("either order sends each vertex of the model once, and no cap's centre") {
    const PreparedModel model = prepare_model(
        tests::join(tests::open_hemisphere(4),
                    tests::translated(tests::edge_shared_by_four(), Vector3d(5.0, 0.0, 0.0))));
    REQUIRE(model.solid.positions.size() > model.vertices.size());
    std::set<std::array<float, 3>> wanted;
    for (const Vector3d& x : model.vertices) {
        wanted.insert(
            {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])});
    }
    std::set<protocol::ObjectId> ids;
    for (const SendingOrder order : {SendingOrder::importance, SendingOrder::spread}) {
        const BroadcastObject object =
            make_object(model, ShapePromise{}, tests::balls_in(model.vertices, 5, 1),
                        {.name = "model", .seed = 1, .tags = {}, .order = order});
        std::set<std::array<float, 3>> sent;
        for (const protocol::VertexRecord& record : object.vertices) {
            sent.insert(record.position);
        }
        CHECK(object.vertices.size() == wanted.size());
        CHECK(sent == wanted);
        CHECK(object.order == order);
        ids.insert(object.id);
    }
    CHECK(ids.size() == 2);
}

TEST_CASE("the queue gives the cheapest vertex, and among equals the first") {
    common::Random random(5);
    VertexQueue queue(200);
    std::set<std::pair<double, std::uint32_t>> model;
    std::vector<std::optional<double>> cost(200);
    for (int step = 0; step < 20'000; ++step) {
        const auto vertex = static_cast<std::uint32_t>(random.below(200));
        if (cost[vertex]) model.erase({*cost[vertex], vertex});
        if (random.chance(0.4)) {
            queue.remove(vertex);
            cost[vertex].reset();
        } else {
            cost[vertex] = static_cast<double>(random.below(50));
            queue.set(vertex, *cost[vertex]);
            model.insert({*cost[vertex], vertex});
        }
        REQUIRE(queue.empty() == model.empty());
        if (!model.empty()) REQUIRE(queue.first() == model.begin()->second);
    }
}

}  // namespace ellicast::sender
