// tests/sender/diagonal_marks_test.cpp
#include "sender/diagonal_marks.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;

}  // namespace

TEST_CASE("where the rule is right nothing is marked") {
    for (const int rule : {0, 1, 2, 4}) {
        const std::vector<char> marks =
            diagonal_marks(tests::icosphere(3), 16, static_cast<std::uint8_t>(rule));
        CHECK(std::count(marks.begin(), marks.end(), 1) == 0);
    }
}

TEST_CASE("diagonals that run against the rule get marks") {
    TriangleMesh mesh = tests::torus(1.0, 0.4, 48, 20);
    for (Eigen::Vector3d& p : mesh.positions) p.x() += 0.3 * p.z();  // one diagonal is the longer
    const std::vector<char> marks = diagonal_marks(mesh, 16, 2);
    REQUIRE(marks.size() == mesh.positions.size());
    CHECK(std::count(marks.begin(), marks.end(), 1) >= 2);
}

TEST_CASE("flat quads are not worth a mark") {
    const std::vector<char> marks = diagonal_marks(tests::box({1, 2, 3}, 4), 8, 4);
    CHECK(std::count(marks.begin(), marks.end(), 1) == 0);
}

}  // namespace ellicast::sender
