// tests/sender/quadratic_form_test.cpp
#include "sender/quadratic_form.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/random.hpp"

namespace ellicast::sender {
namespace {

using common::Random;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

Vector3d random_point(Random& random) {
    return {random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
}

Matrix4d random_convex(Random& random) {
    Matrix3d M;
    for (int i = 0; i < 9; ++i) M.data()[i] = random.uniform() - 0.5;
    const Matrix3d A = M * M.transpose() + 0.02 * Matrix3d::Identity();
    const Vector3d c = random_point(random);
    Matrix4d Q;
    Q.topLeftCorner<3, 3>() = A;
    Q.topRightCorner<3, 1>() = -A * c;
    Q.bottomLeftCorner<1, 3>() = -(A * c).transpose();
    Q(3, 3) = c.dot(A * c);
    return Q;
}

Corners random_triangle(Random& random, double size) {
    const Vector3d a = random_point(random);
    return {a, a + size * random_point(random), a + size * random_point(random)};
}

// The least of f over a grid of points of the triangle.
template <class Function>
double least_on_grid(const Corners& t, const Function& f) {
    constexpr int kSteps = 60;
    double least = 1e300;
    for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
            const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
            least = std::min(least, f(t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])));
        }
    }
    return least;
}

TEST_CASE("a form is the polynomial of its matrix, with its gradient and its Hessian") {
    Random random(1);
    for (int i = 0; i < 100; ++i) {
        const Matrix4d Q = random_convex(random);
        const QuadraticForm F(Q);
        const Vector3d x = random_point(random), d = random_point(random);
        CHECK(F(x) == Approx(x.homogeneous().dot(Q * x.homogeneous())).margin(1e-14));
        CHECK((F.gradient(x) - 2.0 * (Q * x.homogeneous()).head<3>()).norm() < 1e-14);
        CHECK((F.curvature(d) - 2.0 * Q.topLeftCorner<3, 3>() * d).norm() < 1e-14);
        const Matrix4d R = random_convex(random);
        CHECK(combine(F, 0.7, QuadraticForm(R))(x) ==
              Approx(QuadraticForm(Q + 0.7 * R)(x)).margin(1e-14));
    }
}

TEST_CASE("evaluations err by less than the slack") {
    Random random(2);
    for (int i = 0; i < 200; ++i) {
        Matrix4d Q = random_convex(random);
        const Vector3d x = random_point(random);
        // The same value, in long double.
        const QuadraticForm F(Q);
        long double exact = F.c;
        const long double p[3] = {x[0], x[1], x[2]};
        exact += p[0] * (F.xx * p[0] + F.xy * p[1] + F.xz * p[2] + F.x);
        exact += p[1] * (F.yy * p[1] + F.yz * p[2] + F.y) + p[2] * (F.zz * p[2] + F.z);
        CHECK(std::abs(static_cast<double>(exact - static_cast<long double>(F(x)))) <=
              F.rounding_slack(0.5));
    }
}

TEST_CASE("the least point of a triangle is on it, and lower than a grid of others") {
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        CAPTURE(seed);
        Random random(seed);
        const QuadraticForm F(random_convex(random));
        const Corners t = random_triangle(random, random.chance(0.5) ? 1.0 : 0.1);
        const auto x = least_point(F, t, 1e300);
        REQUIRE(x);
        const double grid = least_on_grid(t, [&](const Vector3d& p) { return F(p); });
        CHECK(F(*x) <= grid + 1e-14);
        // On the triangle: barycentric coordinates by areas.
        const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
        double sum = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            const Vector3d &b = t[(i + 1) % 3], &c = t[(i + 2) % 3];
            const double weight = (b - *x).cross(c - *x).dot(n) / n.squaredNorm();
            CHECK(weight > -1e-9);
            sum += weight;
        }
        CHECK(sum == Approx(1.0));
        CHECK(std::abs((*x - t[0]).dot(n.normalized())) < 1e-12);
        CHECK(least_point(F, t, F(*x) + 1e-12));
        CHECK_FALSE(least_point(F, t, F(*x) - 1e-12));
    }
}

TEST_CASE("degenerate triangles are segments or points") {
    Random random(5);
    for (int i = 0; i < 100; ++i) {
        const QuadraticForm F(random_convex(random));
        const Vector3d a = random_point(random), b = random_point(random);
        for (const Corners& t :
             {Corners{a, b, a}, Corners{a, a, b}, Corners{b, a, 0.5 * (a + b)}}) {
            const auto x = least_point(F, t, 1e300);
            REQUIRE(x);
            CHECK(F(*x) <= least_on_grid(t, [&](const Vector3d& p) { return F(p); }) + 1e-13);
        }
        CHECK(*least_point(F, {a, a, a}, 1e300) == a);
    }
}

TEST_CASE("a triangle is met when the first of its points is") {
    std::size_t met = 0;
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        CAPTURE(seed);
        Random random(seed);
        // A ball that grows from p along n, and triangles all around.
        const Vector3d p = random_point(random), n = random_point(random).normalized();
        Matrix4d Q0 = Matrix4d::Identity(), Q1 = Matrix4d::Zero();
        Q0.topRightCorner<3, 1>() = -p;
        Q0.bottomLeftCorner<1, 3>() = -p.transpose();
        Q0(3, 3) = p.squaredNorm();
        Q1.topRightCorner<3, 1>() = -n;
        Q1.bottomLeftCorner<1, 3>() = -n.transpose();
        Q1(3, 3) = 2.0 * n.dot(p);
        const QuadraticForm F0(Q0), F1(Q1);
        const double t_max = 2.0;
        const Corners t = random_triangle(random, 0.5);
        const auto contact = triangle_contact(F0, F1, t, t_max);
        const double grid = least_on_grid(
            t, [&](const Vector3d& x) { return contact_parameter(F0, F1, x).value_or(1e300); });
        if (grid <= t_max) REQUIRE(contact);
        if (!contact) continue;
        ++met;
        CHECK(contact->t <= grid * (1.0 + 1e-12));
        CHECK(contact->t > 0.9 * grid - 0.02);
        CHECK(*contact_parameter(F0, F1, contact->point) == contact->t);
    }
    CHECK(met > 50);
}

}  // namespace
}  // namespace ellicast::sender
