// tests/protocol/radii_test.cpp: the cheap check of an ellipsoid's radii against its true ones.
#include <Eigen/SVD>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "protocol/datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

double between(double low, double high, Random& random) {
    return low + (high - low) * random.uniform();
}

/// Lower triangular, positive diagonal, all scales and every degree of shear.
Eigen::Matrix3d random_L(Random& random) {
    Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
    const double shear = std::pow(10.0, between(-3.0, 3.0, random));
    const double size = std::pow(10.0, between(-6.5, 0.5, random));
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < i; ++j) L(i, j) = size * shear * between(-1.0, 1.0, random);
        L(i, i) = size * std::pow(10.0, between(-1.0, 0.0, random));
    }
    return L;
}

/// Scaled by the diagonal of the hinted box, in float32 as on the wire.
EllipsoidRecord record_of(const Eigen::Matrix3d& L, double diagonal) {
    EllipsoidRecord record{{0.0f, 0.0f, 1.0f}};
    std::size_t k = 3;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j <= i; ++j) record.scalars[k++] = static_cast<float>(diagonal * L(i, j));
    }
    return record;
}

/// What record_of gave, as real numbers in diagonals.
Eigen::Matrix3d L_of(const EllipsoidRecord& record, double diagonal) {
    Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
    std::size_t k = 3;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j <= i; ++j) L(i, j) = static_cast<double>(record.scalars[k++]) / diagonal;
    }
    return L;
}

}  // namespace

TEST_CASE("the check of radii is exact within its two norms") {
    const Hint hint = sample_header().hint;
    const double diagonal = std::sqrt(4.0 + 16.0 + 20.25);
    Random random(21);
    int accepted = 0;
    int allowed = 0;
    for (int round = 0; round < 50'000; ++round) {
        CAPTURE(round);
        const EllipsoidRecord record = record_of(random_L(random), diagonal);
        const Eigen::Matrix3d L = L_of(record, diagonal);
        const Eigen::Matrix3d L_inverse =
            L.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity().eval());
        // As the document says it, apart from cases within rounding of a limit.
        const double ratio = std::max(L.norm(), 1e-6 * L_inverse.norm()) / std::sqrt(3.0);
        const bool good = acceptable(record, hint);
        if (std::abs(ratio - 1.0) > 1e-5) REQUIRE(good == (ratio < 1.0));

        const Eigen::Vector3d radii = Eigen::JacobiSVD<Eigen::Matrix3d>(L).singularValues();
        if (radii[2] >= 1e-6 && radii[0] <= 1.0) {
            ++allowed;
            REQUIRE(good);
        }
        if (!good) continue;
        ++accepted;
        REQUIRE(radii[0] <= 1.0001 * std::sqrt(3.0));
        REQUIRE(radii[2] >= 0.9999e-6 / std::sqrt(3.0));
    }
    CHECK(allowed > 5'000);
    CHECK((accepted > allowed && accepted < 45'000));
}
