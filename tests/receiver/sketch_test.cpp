// tests/receiver/sketch_test.cpp
#include "receiver/sketch.hpp"

#include <catch2/catch.hpp>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "tests/support/datagrams.hpp"

using namespace ellicast;
using namespace ellicast::receiver;

namespace {

ReceivedObject with_ellipsoids(std::size_t count, std::uint64_t seed = 1) {
    const tests::MadeObject made = tests::made_sphere(100, 200, seed);
    ReceivedObject object;
    object.id = made.id;
    object.hint = made.hint;
    for (std::uint32_t k = 0; k < count; ++k) {
        object.ellipsoid_index.push_back(k);
        object.ellipsoids.push_back(made.ellipsoids[k]);
    }
    return object;
}

}  // namespace

TEST_CASE("a sketch is closed, whichever ellipsoids it is made of, and says that it is a guess") {
    for (const std::size_t count : {1u, 7u, 200u}) {
        const auto result = sketch(with_ellipsoids(count), 32, 1);
        REQUIRE(result);
        const auto topology = common::analyse_topology(result->mesh);
        CHECK(topology.closed);
        CHECK(topology.manifold);
        CHECK(common::signed_volume(result->mesh) > 0);
        const std::size_t vertices = result->mesh.positions.size();
        CHECK(result->vertex_index == std::vector(vertices, kNotReceived));
        CHECK(result->provenance == std::vector(vertices, Provenance::coarse));
        CHECK(result->confidence.completeness == std::vector(vertices, 0.0f));
        CHECK(result->confidence.distance.size() == vertices);
    }
}

TEST_CASE("a sketch lies where the model does, origin and all") {
    ReceivedObject object = with_ellipsoids(200);
    object.description.emplace();
    object.description->origin = {1000, -2000, 3000};
    const auto result = sketch(object, 48, 1);
    REQUIRE(result);
    for (const Eigen::Vector3d& p : result->mesh.positions) {
        const double r = (p - Eigen::Vector3d(1000, -2000, 3000)).norm();
        REQUIRE(r > 0.8);
        REQUIRE(r < 1.2);
    }
}

TEST_CASE("a sketch of extreme sizes is as good") {
    ReceivedObject object = with_ellipsoids(50);
    const float scale = GENERATE(1e-25f, 1e25f);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        object.hint.box_min[axis] *= scale;
        object.hint.box_max[axis] *= scale;
    }
    for (auto& record : object.ellipsoids) {
        for (float& x : record.scalars) x *= scale;
    }
    const auto result = sketch(object, 24, 1);
    REQUIRE(result);
    CHECK(common::analyse_topology(result->mesh).closed);
}

TEST_CASE("a sketch of nothing is none, one of a speck is none or closed") {
    CHECK_FALSE(sketch(with_ellipsoids(0), 32, 1));
    ReceivedObject object = with_ellipsoids(1);
    for (std::size_t k = 3; k < 9; ++k) object.ellipsoids[0].scalars[k] *= 1e-5f;
    const auto result = sketch(object, 16, 1);
    if (result) CHECK(common::analyse_topology(result->mesh).closed);
}

TEST_CASE("threads change nothing of a sketch") {
    const ReceivedObject object = with_ellipsoids(100);
    const auto one = sketch(object, 40, 1);
    const auto three = sketch(object, 40, 3);
    REQUIRE(one);
    REQUIRE(three);
    CHECK(one->mesh.positions == three->mesh.positions);
    CHECK(one->mesh.triangles == three->mesh.triangles);
}
