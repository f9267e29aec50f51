// tests/receiver/confidence_test.cpp
#include "receiver/confidence.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "common/random.hpp"
#include "receiver/surface_mesh.hpp"
#include "receiver/vertex_removal.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using Eigen::Vector3d;

namespace {

using Vertices = std::vector<std::uint32_t>;

template <class Wanted>
Vertices vertices_where(const common::TriangleMesh& mesh, const Wanted& wanted) {
    Vertices result;
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        if (wanted(mesh.positions[v])) result.push_back(v);
    }
    return result;
}

Vertices all_of(const common::TriangleMesh& mesh) {
    return vertices_where(mesh, [](const Vector3d&) { return true; });
}

// The mesh without the vertices that are not wanted.
template <class Wanted>
common::TriangleMesh collapsed(const common::TriangleMesh& mesh, const Wanted& wanted) {
    std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    REQUIRE(surface);
    const std::size_t left =
        remove_vertices(*surface, [&](VertexId v) { return !wanted(surface->position(v)); });
    REQUIRE(left == 0);
    return surface->extract();
}

double sum(const std::vector<float>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
}

double angle_from_pole(const Vector3d& p) {
    return std::atan2(std::hypot(p.x(), p.y()), p.z());
}

// A bald cap of this angle around the +z pole of the unit sphere.
constexpr double kCap = 0.6;
bool outside_cap(const Vector3d& p) {
    return angle_from_pole(p) > kCap;
}

}  // namespace

TEST_CASE("where nothing is missing, every distance is 0 and every completeness 1") {
    const common::TriangleMesh mesh = tests::torus(1, 0.4, 30, 15);
    const Vertices received = all_of(mesh);
    const Confidence confidence = measure_confidence(mesh, received, 0, 1);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        REQUIRE(confidence.distance[v] == 0.0F);
        REQUIRE(confidence.completeness[v] == 1.0F);
        REQUIRE(confidence.expected[v] == 1.0F);
    }
    const auto summary =
        summarise(confidence, mesh, received, 0, common::bounding_box(mesh.positions));
    CHECK(summary.missing == 0);
    CHECK_FALSE(summary.largest_gap);
}

TEST_CASE("a bald spot on a sphere is found where it is, and nothing is missing elsewhere") {
    const common::TriangleMesh mesh = tests::icosphere(4);
    const Vertices received = vertices_where(mesh, outside_cap);
    const std::size_t missing = mesh.positions.size() - received.size();
    const Confidence confidence = measure_confidence(mesh, received, missing, 1);
    double in_cap = 0.0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const double angle = angle_from_pole(mesh.positions[v]);
        CAPTURE(angle);
        if (angle > kCap) {
            REQUIRE(confidence.distance[v] == 0.0F);
        } else {
            // Edges of this mesh are 0.07 long, and paths along them up to 2 / sqrt(3) too long.
            REQUIRE(confidence.distance[v] > kCap - angle - 0.01);
            REQUIRE(confidence.distance[v] < 1.16 * (kCap - angle) + 0.08);
            in_cap += static_cast<double>(confidence.expected[v]);
        }
        if (angle > kCap + 0.3) REQUIRE(confidence.completeness[v] > 0.97F);
        if (angle < kCap - 0.3) REQUIRE(confidence.completeness[v] == 0.0F);
    }
    CHECK(in_cap == Approx(missing).epsilon(0.12));
    CHECK(sum(confidence.expected) == Approx(mesh.positions.size()));
}

TEST_CASE("the summary says how large the bald spot is, and in which octants") {
    const common::TriangleMesh mesh = tests::icosphere(4);
    const Vector3d aside = Vector3d(1, 1, 1).normalized();  // in octant 7
    const auto wanted = [&](const Vector3d& p) { return p.dot(aside) < std::cos(kCap); };
    const Vertices received = vertices_where(mesh, wanted);
    const std::size_t missing = mesh.positions.size() - received.size();
    const auto summary = summarise(measure_confidence(mesh, received, missing, 1), mesh, received,
                                   missing, common::bounding_box(mesh.positions));
    CHECK(summary.missing == missing);
    REQUIRE(summary.largest_gap);
    CHECK((summary.largest_gap->center - aside).norm() < 0.1);
    CHECK(summary.largest_gap->radius > kCap - 0.1);
    CHECK(summary.largest_gap->radius < 1.16 * kCap + 0.08);
    const double diagonal = 2.0 * std::sqrt(3.0);
    for (std::size_t k = 0; k < kFartherThan.size(); ++k) {
        CHECK(summary.farther[k].distance == Approx(kFartherThan[k] * diagonal).epsilon(0.01));
        if (k < 2) continue;  // below the length of an edge
        // The cap that is so much smaller; paths are up to 2 / sqrt(3) longer, triangles count
        // whole.
        const auto cap = [](double angle) { return 0.5 * (1 - std::cos(angle)); };
        CHECK(summary.farther[k].share > cap(kCap - summary.farther[k].distance) - 0.005);
        CHECK(summary.farther[k].share < cap(kCap + 0.05 - summary.farther[k].distance / 1.16));
    }
    for (std::size_t octant = 0; octant < 8; ++octant) {
        CAPTURE(octant);
        const auto true_count = vertices_where(mesh, [&](const Vector3d& p) {
                                    return (p.x() > 0) == ((octant & 1) != 0) &&
                                           (p.y() > 0) == ((octant & 2) != 0) &&
                                           (p.z() > 0) == ((octant & 4) != 0);
                                }).size();
        CHECK(summary.octants[octant].expected == Approx(true_count).epsilon(0.15));
        const auto gone =
            static_cast<double>(true_count) - static_cast<double>(summary.octants[octant].received);
        CHECK(gone == Approx(octant == 7 ? missing : 0));
    }
}

TEST_CASE("a bald spot without any vertex in it is found as well") {
    const common::TriangleMesh whole = tests::icosphere(4);
    const common::TriangleMesh mesh = collapsed(whole, outside_cap);
    const Vertices received = all_of(mesh);
    const std::size_t missing = whole.positions.size() - received.size();
    const Confidence confidence = measure_confidence(mesh, received, missing, 1);
    CHECK(sum(confidence.expected) == Approx(whole.positions.size()));
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const double angle = angle_from_pole(mesh.positions[v]);
        CAPTURE(angle);
        if (angle < kCap + 0.04) CHECK(confidence.completeness[v] < 0.75F);
        if (angle > kCap + 0.6) REQUIRE(confidence.completeness[v] > 0.95F);
    }
    const auto summary =
        summarise(confidence, mesh, received, missing, common::bounding_box(whole.positions));
    REQUIRE(summary.largest_gap);
    CHECK(angle_from_pole(summary.largest_gap->center) < kCap);
    CHECK(summary.largest_gap->radius > 0.3 * kCap);
    CHECK(summary.largest_gap->radius < 1.1 * kCap);
}

TEST_CASE("an even loss is about the same everywhere") {
    const double kept = GENERATE(0.8, 0.5, 0.2);
    common::Random random(11);
    const common::TriangleMesh whole = tests::icosphere(5);
    std::vector<bool> wanted(whole.positions.size());
    for (std::size_t v = 0; v < wanted.size(); ++v) wanted[v] = random.chance(kept);
    std::optional<SurfaceMesh> surface = SurfaceMesh::from(whole);
    REQUIRE(remove_vertices(*surface, [&](VertexId v) { return !wanted[v]; }) == 0);
    const common::TriangleMesh mesh = surface->extract();
    const Vertices received = all_of(mesh);
    const Confidence confidence =
        measure_confidence(mesh, received, whole.positions.size() - received.size(), 1);
    const double mean = sum(confidence.completeness) / static_cast<double>(received.size());
    CHECK(mean == Approx(kept).epsilon(0.15));
    std::vector<float> sorted = confidence.completeness;
    std::sort(sorted.begin(), sorted.end());
    CAPTURE(kept, sorted.front(), sorted.back());
    CHECK(sorted[sorted.size() / 20] > 0.5 * kept);
    CHECK(sum(confidence.expected) == Approx(whole.positions.size()));
}

TEST_CASE("a part that nothing received touches is far away and not complete") {
    const common::TriangleMesh one = tests::icosphere(3);
    const common::TriangleMesh mesh = tests::join(one, tests::translated(one, {5, 0, 0}));
    const Vertices received = all_of(one);
    const Confidence confidence = measure_confidence(mesh, received, received.size(), 1);
    const double diagonal = common::bounding_box(mesh.positions).diagonal().norm();
    double beyond = 0.0;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const bool there = v < received.size();
        REQUIRE(confidence.distance[v] == (there ? 0.0F : static_cast<float>(diagonal)));
        if (!there) REQUIRE(confidence.completeness[v] == 0.0F);
        if (!there) beyond += static_cast<double>(confidence.expected[v]);
    }
    CHECK(beyond == Approx(received.size()).epsilon(0.15));
    CHECK(sum(confidence.expected) == Approx(2 * received.size()));
}

TEST_CASE("with nothing received, nothing is complete") {
    const common::TriangleMesh mesh = tests::icosphere(2);
    const Confidence confidence = measure_confidence(mesh, {}, 1000, 1);
    CHECK(sum(confidence.expected) == Approx(1000));
    CHECK(sum(confidence.completeness) == 0.0);
    const float diagonal =
        static_cast<float>(common::bounding_box(mesh.positions).diagonal().norm());
    for (const float d : confidence.distance) REQUIRE(d == diagonal);
}

TEST_CASE("distances are those of the shortest paths, at every share of received vertices") {
    common::TriangleMesh mesh = tests::torus(1.0, 0.3, 40, 20);
    for (std::size_t v = 0; v < mesh.positions.size(); v += 7) {
        mesh.positions[v] = mesh.positions[mesh.triangles[v][0]];  // some coincide
    }
    common::Random random(9);
    const double share = GENERATE(0.002, 0.05, 0.3, 0.9);
    const Vertices received =
        vertices_where(mesh, [&](const Vector3d&) { return random.chance(share); });
    REQUIRE_FALSE(received.empty());
    // Every edge, again and again, until nothing changes.
    const double farthest = common::bounding_box(mesh.positions).diagonal().norm();
    std::vector<double> least(mesh.positions.size(), farthest);
    for (const std::uint32_t v : received) least[v] = 0.0;
    for (bool changed = true; changed;) {
        changed = false;
        for (const common::Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) {
                const std::uint32_t v = t[c];
                const std::uint32_t u = t[(c + 1) % 3];
                const double through_v = least[v] + (mesh.positions[u] - mesh.positions[v]).norm();
                if (!(through_v < least[u])) continue;
                least[u] = through_v;
                changed = true;
            }
        }
    }
    const Confidence confidence = measure_confidence(mesh, received, 10, 1);
    for (std::size_t v = 0; v < least.size(); ++v) {
        REQUIRE(confidence.distance[v] == static_cast<float>(least[v]));
    }
}

TEST_CASE("coincident points and huge counts give finite values between 0 and 1") {
    common::TriangleMesh mesh = tests::icosphere(2);
    const bool all_in_one = GENERATE(false, true);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        if (all_in_one || v % 3 == 0) mesh.positions[v] = Vector3d(0.1, 0.2, 0.3);
    }
    common::Random random(4);
    for (const std::uint64_t missing : {0ULL, 1ULL, 50ULL, 4'000'000'000ULL}) {
        for (const double share : {0.0, 0.4, 1.0}) {
            CAPTURE(all_in_one, missing, share);
            const Vertices received =
                vertices_where(mesh, [&](const Vector3d&) { return random.chance(share); });
            const Confidence confidence = measure_confidence(mesh, received, missing, 2);
            for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
                REQUIRE(std::isfinite(confidence.distance[v]));
                REQUIRE(std::isfinite(confidence.expected[v]));
                REQUIRE(confidence.completeness[v] >= 0.0F);
                REQUIRE(confidence.completeness[v] <= 1.0F);
            }
            const auto summary = summarise(confidence, mesh, received, missing,
                                           common::bounding_box(mesh.positions));
            for (const auto& farther : summary.farther) REQUIRE(std::isfinite(farther.share));
        }
    }
}

TEST_CASE("threads change no bit of the confidence") {
    const common::TriangleMesh mesh = tests::torus(1, 0.4, 60, 30);
    common::Random random(8);
    const Vertices received =
        vertices_where(mesh, [&](const Vector3d&) { return random.chance(0.4); });
    const std::size_t missing = mesh.positions.size() - received.size();
    const Confidence one = measure_confidence(mesh, received, missing, 1);
    const Confidence many = measure_confidence(mesh, received, missing, 7);
    CHECK(one.distance == many.distance);
    CHECK(one.completeness == many.completeness);
    CHECK(one.expected == many.expected);
}
