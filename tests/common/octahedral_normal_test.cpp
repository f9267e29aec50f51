// tests/common/octahedral_normal_test.cpp
#include "common/octahedral_normal.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "common/random.hpp"

using namespace ellicast::common;
using Eigen::Vector3d;

namespace {

double angle(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

Vector3d any_direction(Random& random) {
    const double z = 2.0 * random.uniform() - 1.0;
    const double turn = 2.0 * std::numbers::pi * random.uniform();
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(turn), r * std::sin(turn), z};
}

double error_of(const Vector3d& n, int bits) {
    return angle(n, decode_normal(encode_normal(n, bits), bits));
}

}  // namespace

TEST_CASE("every code of every size is a direction of its own and comes back") {
    for (const int bits : {8, 12, 16}) {
        CAPTURE(bits);
        Vector3d sum = Vector3d::Zero();
        for (int code = 0; code < 1 << bits; ++code) {
            const Vector3d n = decode_normal(static_cast<std::uint16_t>(code), bits);
            REQUIRE(std::abs(n.norm() - 1.0) < 1e-12);
            REQUIRE(encode_normal(n, bits) == code);
            REQUIRE(encode_normal(1e-20 * n, bits) == code);
            sum += n;
        }
        CHECK(sum.norm() < 1e-9 * (1 << bits));  // opposite codes cancel
    }
}

TEST_CASE("codes mean what the document says, worked out by hand") {
    // 8 bits: row and column of four bits each, u = (2 column + 1) / 16 - 1.
    CHECK(decode_normal(0x87, 8).isApprox(Vector3d(-1, 1, 14).normalized()));
    CHECK(decode_normal(0x8f, 8).isApprox(Vector3d(15, 1, 0).normalized()));
    CHECK(decode_normal(0x00, 8).isApprox(Vector3d(-1, -1, -14).normalized()));  // folded
    CHECK(decode_normal(0x0f, 8).isApprox(Vector3d(1, -1, -14).normalized()));
    CHECK(decode_normal(0x2e, 8).isApprox(Vector3d(5, -3, -8).normalized()));
    CHECK(decode_normal(0x83f, 12).isApprox(Vector3d(63, 1, 0).normalized()));
    CHECK(decode_normal(0xff00, 16).isApprox(Vector3d(-1, 1, -254).normalized()));
}

TEST_CASE("bits above the size say nothing") {
    CHECK(decode_normal(0xff34, 8) == decode_normal(0x34, 8));
    CHECK(decode_normal(0xf123, 12) == decode_normal(0x123, 12));
}

TEST_CASE("the code is that of the nearest direction, by comparison with all") {
    Random random(5);
    for (const int bits : {8, 12}) {
        std::vector<Vector3d> all;
        for (int code = 0; code < 1 << bits; ++code) {
            all.push_back(decode_normal(static_cast<std::uint16_t>(code), bits));
        }
        for (int k = 0; k < 2000; ++k) {
            Vector3d n = any_direction(random);
            if (k % 4 == 1) n.z() *= 1e-3;  // near the fold
            if (k % 4 == 2) n.x() *= 1e-9;  // and near an edge of the octahedron
            if (k % 4 == 3) n = Vector3d(n.x(), n.x() + 1e-9, -1).normalized();
            n.normalize();
            double nearest = 4.0;
            for (const Vector3d& other : all) nearest = std::min(nearest, angle(n, other));
            REQUIRE(error_of(n, bits) <= nearest + 1e-12);
        }
    }
}

TEST_CASE("the error stays below the stated angle and comes near it") {
    Random random(6);
    struct Size {
        int bits;
        double mean;
    };
    for (const auto [bits, mean] : {Size{8, 0.0872}, Size{12, 0.0218}, Size{16, 0.00545}}) {
        CAPTURE(bits);
        double largest = 0.0;
        double sum = 0.0;
        constexpr int kDirections = 100'000;
        for (int k = 0; k < kDirections; ++k) {
            const double error = error_of(any_direction(random), bits);
            sum += error;
            largest = std::max(largest, error);
        }
        CHECK(largest <= normal_cell_angle(bits));
        CHECK(largest >= 0.9 * normal_cell_angle(bits));
        CHECK(sum / kDirections == Approx(mean).epsilon(0.01));
    }
}

TEST_CASE("a code is marked or not as asked, and is still near the direction") {
    Random random(7);
    for (const int bits : {8, 12, 16}) {
        CAPTURE(bits);
        for (const bool marked : {false, true}) {
            double sum = 0.0;
            constexpr int kDirections = 20'000;
            for (int k = 0; k < kDirections; ++k) {
                const Vector3d n = any_direction(random);
                const std::uint16_t code = encode_marked_normal(n, bits, marked);
                REQUIRE(is_marked(code, bits) == marked);
                const double error = angle(n, decode_normal(code, bits));
                REQUIRE(error <= (marked ? 3.0 : 2.0) * normal_cell_angle(bits));
                sum += error / normal_cell_angle(bits);
            }
            // 0.5 for the nearest of all codes.
            CHECK(sum / kDirections < (marked ? 1.1 : 0.65));
        }
        CHECK_FALSE(is_marked(encode_marked_normal(Vector3d::Zero(), bits, false), bits));
        CHECK(is_marked(encode_marked_normal(Vector3d::Zero(), bits, true), bits));
    }
}

TEST_CASE("what has no direction gets code 0, and extremes of length do no harm") {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    for (const int bits : {8, 12, 16}) {
        CHECK(encode_normal(Vector3d::Zero(), bits) == 0);
        CHECK(encode_normal({kNan, 1, 0}, bits) == 0);
        CHECK(encode_normal({0, kInfinity, 0}, bits) == 0);
        const Vector3d n(0.3, -0.8, -0.1);
        CHECK(encode_normal(1e300 * n, bits) == encode_normal(n, bits));
        CHECK(encode_normal(1e-300 * n, bits) == encode_normal(n, bits));
    }
}
