// tests/sender/diagonal_marks_test.cpp
#include "sender/diagonal_marks.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/diagonal_choice.hpp"
#include "sender/diagonal_quads.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;

/// The same by a look at all edges for each trial.
std::vector<char> plain_marks(const TriangleMesh& solid, int normal_bits, std::uint8_t rule) {
    const std::vector<Eigen::Vector3d> normals = received_normals(solid, normal_bits, 1);
    const Quads quads(solid, normals, 1);
    const common::DiagonalWeights weights = common::diagonal_weights(rule, true, 0.0);
    const double unit = common::mean_edge_length(solid);
    struct Edge {
        std::array<std::uint32_t, 4> id{};
        double gain = 0;
        double cost = 0;
    };
    std::vector<Edge> edges;
    for (HalfEdge h = 0; h < quads.half_edges(); ++h) {
        if (!quads.has_quad(h)) continue;
        edges.push_back({quads.ids(h),
                         common::weighed_diagonal_gain(quads.quad(h), weights, unit) / unit,
                         quads.wrong_diagonal(h)});
    }
    std::vector<char> marks(solid.positions.size(), 0);
    const auto cost = [&](const Edge& e) {
        const auto [a, b, c, d] = e.id;
        const double marked = (marks[c] && marks[d] ? 1 : 0) - (marks[a] && marks[b] ? 1 : 0);
        return e.gain + weights.mark * marked > common::kLeastDiagonalGain ? e.cost : 0.0;
    };
    const auto cost_around = [&](std::uint32_t a, std::uint32_t b) {
        double sum = 0.0;
        for (const Edge& e : edges) {
            const bool near = std::any_of(e.id.begin(), e.id.end(),
                                          [&](std::uint32_t v) { return v == a || v == b; });
            if (near) sum += cost(e);
        }
        return sum;
    };
    double least = 0.0;
    std::vector<Edge> wrong;
    for (const Edge& e : edges) {
        if (cost(e) > 0.0) wrong.push_back(e);
        least += 1e-4 * cost(e);
    }
    std::stable_sort(wrong.begin(), wrong.end(),
                     [](const Edge& x, const Edge& y) { return x.cost > y.cost; });
    for (const Edge& e : wrong) {
        const auto [a, b, c, d] = e.id;
        if (e.cost < least || (marks[a] && marks[b])) continue;
        const std::array<char, 2> before{marks[a], marks[b]};
        const double cost_before = cost_around(a, b);
        marks[a] = marks[b] = 1;
        if (cost_around(a, b) < cost_before - least) continue;
        marks[a] = before[0];
        marks[b] = before[1];
    }
    return marks;
}

}  // namespace

TEST_CASE("marks are those that a look at all edges gives, on any number of threads") {
    TriangleMesh mesh = tests::torus(1.0, 0.4, 40, 24);
    for (Eigen::Vector3d& p : mesh.positions) {  // bumps that the mesh knows nothing of
        p *= 1.0 + 0.05 * std::sin(17.0 * p.x()) * std::cos(13.0 * p.y());
    }
    for (const int rule : {0, 2, 5}) {
        const auto r = static_cast<std::uint8_t>(rule);
        const std::vector<char> expected = plain_marks(mesh, 8, r);
        CHECK(std::count(expected.begin(), expected.end(), 1) >= 20);
        CHECK(diagonal_marks(mesh, 8, r, 1) == expected);
        CHECK(diagonal_marks(mesh, 8, r, 3) == expected);
    }
}

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
