// tests/sender/constraint_tree_test.cpp
#include "sender/constraint_tree.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "common/random.hpp"
#include "tests/sender/constraint_scan.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::Random;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

Vector3d random_point(Random& random) {
    return {random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
}

Vector3d random_direction(Random& random) {
    for (;;) {
        const Vector3d v = 2.0 * random_point(random);
        if (v.norm() > 0.1 && v.norm() <= 1.0) return v.normalized();
    }
}

// Points of several characters: a cloud, a surface, a grid with ties without end, copies of one
// point.
std::vector<Vector3d> make_points(std::size_t count, int character, Random& random) {
    std::vector<Vector3d> points;
    while (points.size() < count) {
        const Vector3d x = random_point(random);
        switch (character) {
            case 0:
                points.push_back(x);
                break;
            case 1:
                points.push_back(0.4 * random_direction(random));
                break;
            case 2:
                points.push_back((4.0 * x).array().round() / 8.0);
                break;
            default:
                points.emplace_back(0.1, 0.2, 0.3);
                break;
        }
    }
    return points;
}

// Triangles of several characters: large, small, needles, points, and copies.
std::vector<Corners> make_triangles(std::size_t count, int character, Random& random) {
    std::vector<Corners> triangles;
    while (triangles.size() < count) {
        const Vector3d a = random_point(random);
        const double size = character == 0 ? 1.0 : 0.05;
        const Vector3d u = size * random_direction(random);
        Vector3d v = size * random_direction(random);
        if (character == 2) v = u * random.uniform() + 1e-9 * v;
        if (character == 3) triangles.push_back({a, a, a});
        triangles.push_back({a, a + u, a + v});
        if (character == 1) triangles.push_back(triangles.back());
    }
    triangles.resize(count);
    return triangles;
}

struct Problem {
    QuadraticForm F0, F1;
    double t_max = 0;
};

Matrix4d random_ellipsoid(Random& random) {
    Matrix3d M;
    for (int i = 0; i < 9; ++i) M.data()[i] = random.uniform() - 0.5;
    const Matrix3d A = M * M.transpose() + 0.05 * Matrix3d::Identity();
    const Vector3d c = random_point(random);
    Matrix4d Q;
    Q.topLeftCorner<3, 3>() = A;
    Q.topRightCorner<3, 1>() = -A * c;
    Q.bottomLeftCorner<1, 3>() = -(A * c).transpose();
    Q(3, 3) = c.dot(A * c);
    return Q;
}

// The stages of growth, with random numbers in place of what growth would ask.
Problem sphere_problem(const Vector3d& p, const Vector3d& n) {
    Matrix4d F0 = Matrix4d::Identity(), F1 = Matrix4d::Zero();
    F0.topRightCorner<3, 1>() = -p;
    F0.bottomLeftCorner<1, 3>() = -p.transpose();
    F0(3, 3) = p.squaredNorm();
    F1.topRightCorner<3, 1>() = -n;
    F1.bottomLeftCorner<1, 3>() = -n.transpose();
    F1(3, 3) = 2.0 * n.dot(p);
    return {QuadraticForm(F0), QuadraticForm(F1), 2.0};
}

Problem cylinder_problem(Random& random) {
    const Matrix4d Q = random_ellipsoid(random);
    const Vector3d n = random_direction(random);
    Matrix4d P = Matrix4d::Identity();
    P.topLeftCorner<3, 3>() -= n * n.transpose();
    Matrix4d F1 = P.transpose() * Q * P;
    F1(3, 3) -= 0.02 * random.uniform();
    return {QuadraticForm(Q), QuadraticForm(F1), 10.0 * random.uniform()};
}

Problem inflation_problem(Random& random) {
    Matrix4d F1 = Matrix4d::Zero();
    F1(3, 3) = -1.0;
    return {QuadraticForm(random_ellipsoid(random)), QuadraticForm(F1), random.uniform()};
}

Problem random_problem(const std::vector<Vector3d>& points, Random& random) {
    switch (random.below(3)) {
        case 0: {
            const bool at_point = random.chance(0.5);
            const Vector3d p =
                at_point ? points[random.below(points.size())] : random_point(random);
            return sphere_problem(p, random_direction(random));
        }
        case 1:
            return cylinder_problem(random);
        default:
            return inflation_problem(random);
    }
}

void check_equal(const std::optional<Contact>& found, const std::optional<Contact>& expected) {
    REQUIRE(found.has_value() == expected.has_value());
    if (!found) return;
    CHECK(found->constraint == expected->constraint);
    CHECK(found->point == expected->point);
    CHECK(found->t == expected->t);  // to the bit
}

TEST_CASE("the tree finds what a scan finds, to the bit") {
    for (const std::size_t count : {1u, 2u, 15u, 16u, 17u, 128u, 129u, 1000u, 1025u, 5000u}) {
        for (int character = 0; character < 4; ++character) {
            const std::uint64_t seed = 100 * count + static_cast<std::uint64_t>(character);
            CAPTURE(count, character, seed);
            Random random(seed);
            const std::vector<Vector3d> points = make_points(count, character, random);
            const ConstraintTree tree({points, {}});
            const tests::ConstraintScan scan({points, {}});
            for (int i = 0; i < 60; ++i) {
                const Problem problem = random_problem(points, random);
                check_equal(tree.first_contact(problem.F0, problem.F1, problem.t_max),
                            scan.first_contact(problem.F0, problem.F1, problem.t_max, {}));
            }
        }
    }
}

TEST_CASE("the tree finds what a scan finds among triangles, too") {
    for (const std::size_t count : {1u, 2u, 8u, 9u, 64u, 65u, 600u}) {
        for (int character = 0; character < 4; ++character) {
            const std::uint64_t seed = 100 * count + static_cast<std::uint64_t>(character);
            CAPTURE(count, character, seed);
            Random random(seed);
            const std::vector<Vector3d> points = make_points(count / 2 + 1, 0, random);
            const Constraints constraints{points, make_triangles(count, character, random)};
            const ConstraintTree tree(constraints);
            const tests::ConstraintScan scan(constraints);
            for (int i = 0; i < 60; ++i) {
                const Problem problem = random_problem(points, random);
                check_equal(tree.first_contact(problem.F0, problem.F1, problem.t_max),
                            scan.first_contact(problem.F0, problem.F1, problem.t_max, {}));
            }
        }
    }
}

TEST_CASE("guesses change nothing, good, bad or repeated") {
    Random random(7);
    const std::vector<Vector3d> points = make_points(3000, 1, random);
    const ConstraintTree tree({points, make_triangles(300, 1, random)});
    for (int i = 0; i < 300; ++i) {
        const Problem problem = random_problem(points, random);
        const auto plain = tree.first_contact(problem.F0, problem.F1, problem.t_max);
        std::vector<std::uint32_t> guesses = {0, 0, 2999, 3299, 3300, 4000'000'000u};
        if (plain) guesses.push_back(plain->constraint);
        guesses.push_back(static_cast<std::uint32_t>(random.below(3300)));
        check_equal(tree.first_contact(problem.F0, problem.F1, problem.t_max, guesses), plain);
    }
}

TEST_CASE("equal contacts go to the smaller index") {
    // A sphere from the bottom touches the four corners of the square at once.
    const std::vector<Vector3d> points = {
        {0.3, 0.3, 0.5}, {-0.3, 0.3, 0.5}, {0.3, -0.3, 0.5}, {-0.3, -0.3, 0.5}, {0.3, 0.3, 0.5}};
    const Problem problem = sphere_problem(Vector3d::Zero(), Vector3d::UnitZ());
    for (std::uint32_t guess = 0; guess < points.size(); ++guess) {
        const auto contact = ConstraintTree({points, {}})
                                 .first_contact(problem.F0, problem.F1, problem.t_max,
                                                std::array<std::uint32_t, 1>{guess});
        REQUIRE(contact);
        CHECK(contact->constraint == 0);
    }
}

TEST_CASE("a tree over moved points answers for the moved points") {
    Random random(11);
    const std::vector<Vector3d> points = make_points(2000, 1, random);
    std::vector<Vector3d> moved = points;
    for (Vector3d& p : moved) p += 0.05 * random_point(random);
    const std::vector<Corners> triangles = make_triangles(200, 1, random);
    std::vector<Corners> moved_triangles = triangles;
    for (Corners& t : moved_triangles) t[1] += 0.05 * random_point(random);
    const ConstraintTree tree({moved, moved_triangles}, ConstraintTree({points, triangles}));
    const tests::ConstraintScan scan({moved, moved_triangles});
    for (int i = 0; i < 200; ++i) {
        const Problem problem = random_problem(moved, random);
        check_equal(tree.first_contact(problem.F0, problem.F1, problem.t_max),
                    scan.first_contact(problem.F0, problem.F1, problem.t_max, {}));
    }
}

TEST_CASE("beyond t_max there is no contact, and at t_max there is") {
    const ConstraintTree tree({{Vector3d(0.0, 0.0, 1.0)}, {}});
    const Problem problem = sphere_problem(Vector3d::Zero(), Vector3d::UnitZ());
    CHECK_FALSE(tree.first_contact(problem.F0, problem.F1, 0.4999));
    const auto contact = tree.first_contact(problem.F0, problem.F1, 0.5);
    REQUIRE(contact);
    CHECK(contact->t == 0.5);
}

TEST_CASE("a point that lies inside from the start stops growth at once") {
    const ConstraintTree tree({{Vector3d(0.0, 0.0, 0.1)}, {}});
    Problem problem = sphere_problem(Vector3d::Zero(), Vector3d::UnitZ());
    problem.F0.c -= 0.25;
    const auto contact = tree.first_contact(problem.F0, problem.F1, 1.0);
    REQUIRE(contact);
    CHECK(contact->t == 0.0);
}

TEST_CASE("an empty tree meets nothing") {
    const Problem problem = sphere_problem(Vector3d::Zero(), Vector3d::UnitZ());
    CHECK_FALSE(ConstraintTree(Constraints{}).first_contact(problem.F0, problem.F1, 1.0));
}

}  // namespace
}  // namespace ellicast::sender
