// tests/common/morton_order_test.cpp
#include "common/morton_order.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <numeric>
#include <vector>

#include "common/random.hpp"

using namespace ellicast::common;
using Eigen::Vector3d;

namespace {

// Whether p comes before q along the curve: the first bit in which any coordinates differ decides,
// z before y before x in each level. Cells by their definition.
bool before(const Vector3d& p, const Vector3d& q) {
    for (int bit = 20; bit >= 0; --bit) {
        for (int axis = 2; axis >= 0; --axis) {
            const auto cell = [&](double x) { return static_cast<std::uint32_t>(x) >> bit & 1u; };
            if (cell(p[axis]) != cell(q[axis])) return cell(p[axis]) < cell(q[axis]);
        }
    }
    return false;
}

TEST_CASE("the order along the Morton curve is that of its definition, ties by index") {
    // A cube whose side is the number of cells, so that coordinates are cells.
    constexpr double kSide = (1 << 21) - 1;
    Random random(1);
    std::vector<Vector3d> positions = {{0, 0, 0}, {kSide, kSide, kSide}};
    for (int n = 0; n < 3'000; ++n) {
        // Most of them near to one another, some in one place.
        const double range = random.chance(0.5) ? 8.0 : kSide;
        const auto some = [&] { return range * random.uniform(); };
        positions.emplace_back(some(), some(), some());
    }
    std::vector<std::uint32_t> expected(positions.size());
    std::iota(expected.begin(), expected.end(), 0u);
    std::stable_sort(expected.begin(), expected.end(), [&](std::uint32_t a, std::uint32_t b) {
        return before(positions[a], positions[b]);
    });
    REQUIRE(morton_order(positions) == expected);
}

TEST_CASE("no position, one, and many in one place keep their order") {
    REQUIRE(morton_order({}).empty());
    REQUIRE(morton_order({{3, 4, 5}}) == std::vector<std::uint32_t>{0});
    REQUIRE(morton_order({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}) == std::vector<std::uint32_t>{0, 1, 2});
}

}  // namespace
