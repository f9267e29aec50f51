// tests/common/vertex_normals_test.cpp
#include "common/vertex_normals.hpp"

#include <catch2/catch.hpp>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using Eigen::Vector3d;

TEST_CASE("vertex normals are exact on a sphere, however uneven its triangles") {
    common::TriangleMesh mesh = tests::icosphere(3);
    common::Random random(4);
    for (Vector3d& p : mesh.positions) {
        p += 0.03 * Vector3d(random.uniform(), random.uniform(), random.uniform());
        p.normalize();
    }
    const std::vector<Vector3d> normals = common::vertex_normals(mesh);
    REQUIRE(normals.size() == mesh.positions.size());
    for (std::size_t v = 0; v < normals.size(); ++v) {
        REQUIRE((normals[v] - mesh.positions[v]).norm() < 1e-9);
    }
}

TEST_CASE("where all triangles have no area, the normal is zero") {
    common::TriangleMesh mesh = tests::icosphere(1);
    for (Vector3d& p : mesh.positions) p = Vector3d(1, 2, 3);
    for (const Vector3d& normal : common::vertex_normals(mesh)) REQUIRE(normal == Vector3d::Zero());
}
