// tests/common/exact_orientation_test.cpp
#include "common/exact_orientation.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/random.hpp"

namespace {

using namespace ellicast::common;
using Eigen::Vector2d;
using Eigen::Vector3d;
__extension__ using Wide = __int128;
using Node = std::array<std::int64_t, 3>;

int sign(Wide value) {
    return value > 0 ? 1 : value < 0 ? -1 : 0;
}

// The same determinants in integers.
int oracle(const Node& a, const Node& b, const Node& c, const Node& d) {
    std::array<std::array<Wide, 3>, 3> m{};
    for (std::size_t i = 0; i < 3; ++i) {
        m[0][i] = a[i] - d[i];
        m[1][i] = b[i] - d[i];
        m[2][i] = c[i] - d[i];
    }
    return sign(m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) +
                m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
                m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]));
}

int oracle(const Node& a, const Node& b, const Node& c) {
    const Wide left = static_cast<Wide>(a[0] - c[0]) * (b[1] - c[1]);
    const Wide right = static_cast<Wide>(a[1] - c[1]) * (b[0] - c[0]);
    return sign(left - right);
}

Vector3d point(const Node& n, double scale) {
    return scale * Vector3d(static_cast<double>(n[0]), static_cast<double>(n[1]),
                            static_cast<double>(n[2]));
}

Node random_node(Random& random, std::int64_t range) {
    Node n{};
    for (auto& x : n) {
        x = static_cast<std::int64_t>(random.below(static_cast<std::size_t>(2 * range + 1))) -
            range;
    }
    return n;
}

}  // namespace

TEST_CASE("the sides of a plane and of a line have the signs of the header") {
    const Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
    CHECK(orientation(a, b, c, Vector3d(0, 0, -1)) == 1);  // from below they turn clockwise
    CHECK(orientation(a, b, c, Vector3d(0, 0, 1)) == -1);
    CHECK(orientation(a, b, c, Vector3d(7, -3, 0)) == 0);
    CHECK(orientation(Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)) == 1);
    CHECK(orientation(Vector2d(0, 0), Vector2d(0, 1), Vector2d(1, 0)) == -1);
    CHECK(orientation(Vector2d(0, 0), Vector2d(1, 1), Vector2d(3, 3)) == 0);
}

TEST_CASE("orientation is exact for points in or next to a plane") {
    const std::uint64_t seed = GENERATE(range(1, 6));
    CAPTURE(seed);
    Random random(seed);
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(100)) - 50);
    std::array<int, 3> seen{};
    for (int trial = 0; trial < 3'000; ++trial) {
        // Differences below 2^41: the determinant stays below 2^127.
        const Node a = random_node(random, std::int64_t{1} << 38);
        const Node u = random_node(random, 1 << 18);
        const Node v = random_node(random, 1 << 18);
        const Node jump = random_node(random, 1 << 18);
        const Node off = random_node(random, 1);
        Node b{}, c{}, d{};
        for (std::size_t i = 0; i < 3; ++i) {
            b[i] = a[i] + u[i];
            c[i] = a[i] + v[i];
            d[i] = a[i] + jump[0] * u[i] + jump[1] * v[i];
            if (trial % 2 == 0) d[i] += off[i];
        }
        const int expected = oracle(a, b, c, d);
        ++seen[static_cast<std::size_t>(expected + 1)];
        const Vector3d pa = point(a, scale), pb = point(b, scale);
        const Vector3d pc = point(c, scale), pd = point(d, scale);
        REQUIRE(orientation(pa, pb, pc, pd) == expected);
        REQUIRE(orientation(pb, pa, pc, pd) == -expected);
        REQUIRE(orientation(pd, pb, pc, pa) == -expected);
        REQUIRE(orientation(pb, pc, pa, pd) == expected);
    }
    CHECK(seen[0] > 100);
    CHECK(seen[1] > 100);
    CHECK(seen[2] > 100);
}

TEST_CASE("orientation is exact for points on or next to a line") {
    const std::uint64_t seed = GENERATE(range(1, 6));
    CAPTURE(seed);
    Random random(seed);
    for (int trial = 0; trial < 3'000; ++trial) {
        const Node a = random_node(random, std::int64_t{1} << 50);
        const Node u = random_node(random, 1 << 24);
        const Node off = random_node(random, 1);
        const Node steps = random_node(random, 1 << 24);
        Node b{}, c{};
        for (std::size_t i = 0; i < 2; ++i) {
            b[i] = a[i] + u[i];
            c[i] = a[i] + steps[0] * u[i] + off[i];
        }
        const int expected = oracle(a, b, c);
        const Vector2d pa = point(a, 1.0).head<2>();
        const Vector2d pb = point(b, 1.0).head<2>();
        const Vector2d pc = point(c, 1.0).head<2>();
        REQUIRE(orientation(pa, pb, pc) == expected);
        REQUIRE(orientation(pb, pa, pc) == -expected);
        REQUIRE(orientation(pc, pa, pb) == expected);
    }
}

TEST_CASE("differences that do not fit a double are exact as well") {
    // Points around (1/2, 1/2) in steps of 2^-53, against the line through (12, 12) and (24, 24).
    for (int i = 0; i < 64; ++i) {
        for (int j = 0; j < 64; ++j) {
            const Vector2d p(0.5 + i * 0x1.0p-53, 0.5 + j * 0x1.0p-53);
            const int expected = p[0] < p[1] ? 1 : p[0] > p[1] ? -1 : 0;
            REQUIRE(orientation(p, Vector2d(12, 12), Vector2d(24, 24)) == expected);
            const Vector3d q(p[0], p[1], 1e-3);
            REQUIRE(orientation(Vector3d(12, 12, 0), Vector3d(24, 24, 0), Vector3d(24, 24, 7), q) ==
                    -orientation(Vector3d(24, 24, 0), Vector3d(12, 12, 0), Vector3d(24, 24, 7), q));
            REQUIRE(std::abs(orientation(Vector3d(12, 12, 0), Vector3d(24, 24, 0),
                                         Vector3d(24, 24, 7), q)) == std::abs(expected));
        }
    }
}
