// tests/protocol/box_check_test.cpp
#include "protocol/box_check.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

/// Places have boxes of their own: [-k - 1, k + 0.5].
BoxBlock least_corner() {
    BoxBlock least{};
    for (std::size_t k = 0; k < kBoxBlock; ++k) least[k] = -static_cast<float>(k) - 1.0f;
    return least;
}
BoxBlock greatest_corner() {
    BoxBlock most{};
    for (std::size_t k = 0; k < kBoxBlock; ++k) most[k] = static_cast<float>(k) + 0.5f;
    return most;
}

/// Wide and plain form at once; they must agree.
bool inside(const std::vector<float>& scalars) {
    Bytes bytes;
    for (const float x : scalars) put_f32(bytes, x);
    const std::size_t blocks = scalars.size() / kBoxBlock;
    const BoxBlock least = least_corner();
    const BoxBlock most = greatest_corner();
    const bool wide = all_inside(bytes.data(), blocks, least, most);
    REQUIRE(all_inside_plain(bytes.data(), blocks, least, most) == wide);
    return wide;
}

}  // namespace

TEST_CASE("one number outside its own place's box is found wherever it stands") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t blocks = 0; blocks < 12; ++blocks) {
        std::vector<float> scalars(blocks * kBoxBlock, 0.25f);
        REQUIRE(inside(scalars));
        for (std::size_t at = 0; at < scalars.size(); ++at) {
            CAPTURE(blocks, at);
            const float least = least_corner()[at % kBoxBlock];
            const float most = greatest_corner()[at % kBoxBlock];
            for (const float good : {least, most, 0.0f, -0.0f, 1e-45f}) {
                scalars[at] = good;
                REQUIRE(inside(scalars));
            }
            for (const float bad :
                 {std::nextafter(least, -kInfinity), std::nextafter(most, kInfinity), kInfinity,
                  -kInfinity, kNan, -kNan}) {
                scalars[at] = bad;
                REQUIRE_FALSE(inside(scalars));
            }
            scalars[at] = 0.25f;
        }
    }
}
