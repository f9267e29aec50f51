// tests/receiver/edge_flips_test.cpp
#include "receiver/edge_flips.hpp"
#include "receiver/surface_smoothing.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <set>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

SurfaceMesh surface(const common::TriangleMesh& mesh) {
    std::optional<SurfaceMesh> result = SurfaceMesh::from(mesh);
    REQUIRE(result);
    return std::move(*result);
}

// Flips edges of which no two touch one face, so that each damage stands alone.
std::size_t flip_at_random(SurfaceMesh& mesh, std::uint64_t seed, std::size_t attempts) {
    common::Random random(seed);
    std::vector<bool> touched(mesh.face_slots(), false);
    std::size_t flips = 0;
    for (std::size_t n = 0; n < attempts; ++n) {
        const auto h = static_cast<HalfedgeId>(random.below(3 * mesh.face_slots()));
        const FaceId f = SurfaceMesh::face_of(h);
        const FaceId g = SurfaceMesh::face_of(mesh.twin(h));
        if (touched[f] || touched[g] || !mesh.can_flip(h)) continue;
        mesh.flip(h);
        touched[f] = touched[g] = true;
        ++flips;
    }
    return flips;
}

// What smoothing flips minimise, straight from its definition.
double crease_sum(const SurfaceMesh& mesh) {
    double sum = 0.0;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        if (mesh.twin(h) < h) continue;
        const double length =
            (mesh.position(mesh.from_vertex(h)) - mesh.position(mesh.to_vertex(h))).norm();
        const Vector3d n1 = mesh.area_normal(SurfaceMesh::face_of(h));
        const Vector3d n2 = mesh.area_normal(SurfaceMesh::face_of(mesh.twin(h)));
        sum += length * (0.1 + std::atan2(n1.cross(n2).norm(), n1.dot(n2)));
    }
    return sum;
}

double angle(const Vector3d& u, const Vector3d& v) {
    return std::atan2(u.cross(v).norm(), u.dot(v));
}

// Largest excess over 180 degrees of two opposite angles.
double worst_delaunay_excess(const SurfaceMesh& mesh) {
    double worst = 0.0;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        const Vector3d& a = mesh.position(mesh.from_vertex(h));
        const Vector3d& b = mesh.position(mesh.to_vertex(h));
        const Vector3d& c = mesh.position(mesh.opposite(h));
        const Vector3d& d = mesh.position(mesh.opposite(mesh.twin(h)));
        worst = std::max(worst, angle(a - c, b - c) + angle(a - d, b - d) - std::numbers::pi);
    }
    return worst;
}

TEST_CASE("triangle quality is 1 for equilateral, 0 for degenerate triangles") {
    REQUIRE(triangle_quality({0, 0, 0}, {1, 0, 0}, {0.5, std::sqrt(0.75), 0}) == Approx(1.0));
    REQUIRE(triangle_quality({0, 0, 0}, {1, 0, 0}, {3, 0, 0}) == 0.0);
    REQUIRE(triangle_quality({1, 1, 1}, {1, 1, 1}, {1, 1, 1}) == 0.0);
    REQUIRE(triangle_quality({0, 0, 0}, {2, 0, 0}, {0, 2, 0}) ==
            Approx(triangle_quality({0, 0, 0}, {1e-9, 0, 0}, {0, 1e-9, 0})));
}

TEST_CASE("a finely triangulated sphere becomes Delaunay again after a few random flips") {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        INFO("seed " << seed);
        SurfaceMesh mesh = surface(tests::icosphere(4));
        REQUIRE(flip_at_random(mesh, seed, 200) > 100);
        REQUIRE(worst_delaunay_excess(mesh) > 0.1);
        REQUIRE(flip_all_to_delaunay(mesh) > 0);
        REQUIRE(mesh.validate().empty());
        REQUIRE(worst_delaunay_excess(mesh) < 1e-6);
        REQUIRE(flip_all_to_delaunay(mesh) == 0);
    }
}

TEST_CASE("Delaunay flips do not cut the edges off a box") {
    SurfaceMesh mesh = surface(tests::box({1, 1, 1}, 4));
    const double volume = common::signed_volume(mesh.extract());
    flip_all_to_delaunay(mesh);
    REQUIRE(common::signed_volume(mesh.extract()) == Approx(volume));
}

TEST_CASE("smoothing flips restore the creases of a box") {
    const common::TriangleMesh original = tests::box({1.0, 0.8, 0.6}, 6);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        INFO("seed " << seed);
        SurfaceMesh mesh = surface(original);
        flip_at_random(mesh, seed, 60);
        REQUIRE(common::measure_distance(mesh.extract(), original).rms() > 1e-3);
        flip_to_smooth(mesh);
        REQUIRE(mesh.validate().empty());
        REQUIRE(common::measure_distance(mesh.extract(), original).rms() < 1e-9);
    }
}

TEST_CASE("a diagonal between two marked vertices stays against creases, and others do not") {
    SurfaceMesh mesh = surface(tests::icosphere(3));
    const HalfedgeId h = 3 * 100;
    REQUIRE(mesh.can_flip(h));
    mesh.flip(h);
    const std::set ends{mesh.from_vertex(h), mesh.to_vertex(h)};
    const auto still_there = [&](const SurfaceMesh& m) {
        for (HalfedgeId k = 0; k < 3 * m.face_slots(); ++k) {
            if (std::set{m.from_vertex(k), m.to_vertex(k)} == ends) return true;
        }
        return false;
    };
    std::vector<char> marks(mesh.vertex_slots(), 0);
    marks[*ends.begin()] = 1;
    SurfaceMesh half = mesh;
    flip_to_smooth(half, {.weights = {.mark = 2.0}, .marks = marks});
    CHECK_FALSE(still_there(half));
    marks[*ends.rbegin()] = 1;
    SurfaceMesh both = mesh;
    CHECK(flip_to_smooth(both, {.weights = {.mark = 2.0}, .marks = marks}) == 0);
    CHECK(still_there(both));
    // It is found as well, not only kept.
    CHECK(flip_to_smooth(half, {.weights = {.mark = 2.0}, .marks = marks}) == 1);
    CHECK(still_there(half));
}

TEST_CASE("smoothing flips lower what they minimise, and hardly find more the second time") {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        INFO("seed " << seed);
        SurfaceMesh mesh = surface(tests::torus(1, 0.4, 24, 16));
        const double intact = crease_sum(mesh);
        REQUIRE(flip_at_random(mesh, seed, 400) > 50);
        const double damaged = crease_sum(mesh);
        REQUIRE(damaged > 1.02 * intact);
        const std::size_t flips = flip_to_smooth(mesh, {}, 50);
        const double mended = crease_sum(mesh);
        REQUIRE(mended < 1.001 * intact);
        REQUIRE(flip_to_smooth(mesh, {}, 50) * 20 < flips);
        REQUIRE(crease_sum(mesh) <= mended + 1e-9);
        REQUIRE(mesh.validate().empty());
    }
}

TEST_CASE("threads do not change what is flipped") {
    std::vector<std::vector<common::Triangle>> results;
    // One region, and some.
    const int around = GENERATE(30, 240);
    for (const unsigned threads : {1U, 3U}) {
        SurfaceMesh mesh = *SurfaceMesh::from(tests::torus(1.0, 0.4, around, 120));
        common::Random random(4);
        for (int n = 0; n < 20 * around; ++n) {
            const auto h = static_cast<HalfedgeId>(random.below(3 * mesh.face_slots()));
            if (mesh.can_flip(h)) mesh.flip(h);
        }
        SurfaceMesh delaunay = mesh;
        REQUIRE(flip_to_smooth(mesh, {}, SurfaceSmoother::kPasses, threads) > 100);
        REQUIRE(mesh.validate().empty());
        results.push_back(mesh.extract().triangles);
        REQUIRE(flip_all_to_delaunay(delaunay, threads) > 100);
        REQUIRE(delaunay.validate().empty());
        results.push_back(delaunay.extract().triangles);
    }
    REQUIRE(results[0] == results[2]);
    REQUIRE(results[1] == results[3]);
}

TEST_CASE("nothing is left to flip where regions meet") {
    SurfaceMesh mesh = *SurfaceMesh::from(tests::torus(1.0, 0.4, 240, 120));
    const std::size_t broken = flip_at_random(mesh, 5, 20'000);
    REQUIRE(broken > 5'000);
    SurfaceMesh smooth = mesh;
    REQUIRE(flip_all_to_delaunay(mesh, 2) > 3'000);
    REQUIRE(flip_all_to_delaunay(mesh, 2) == 0);
    const std::size_t flips = flip_to_smooth(smooth, {}, 50);
    REQUIRE(flip_to_smooth(smooth, {}, 50) * 50 < flips);
}

}  // namespace
}  // namespace ellicast::receiver
