// tests/support/made_models_test.cpp
#include "tests/support/made_models.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "common/mesh_topology.hpp"
#include "common/self_intersection.hpp"

using namespace ellicast::common;
using namespace ellicast::tests;

namespace {

void check_model(const std::string& name, std::int64_t genus) {
    CAPTURE(name);
    const TriangleMesh mesh = made_model(name);
    const MeshTopology topology = analyse_topology(mesh);
    CHECK(topology.closed);
    CHECK(topology.manifold);
    CHECK(topology.components == 1);
    CHECK(topology.genus() == genus);
    CHECK(topology.vertices == mesh.positions.size());
    CHECK(topology.vertices > 5'000);
    CHECK(topology.vertices < 60'000);
    CHECK(signed_volume(mesh) > 0);
    CHECK(count_self_intersections(mesh).pairs == 0);
}

}  // namespace

TEST_CASE("made models are closed, outward and free of self-intersections") {
    check_model("turned-part", 1);
    check_model("knot", 1);
    check_model("boulder", 0);
    check_model("rope-rings", 2);
    CHECK(made_model_names().size() == 4);
    CHECK_THROWS_AS(made_model("teapot"), std::invalid_argument);
}
