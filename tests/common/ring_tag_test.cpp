// tests/common/ring_tag_test.cpp
#include "common/ring_tag.hpp"

#include <array>
#include <catch2/catch.hpp>

#include "common/random.hpp"

using namespace ellicast::common;

TEST_CASE("a ring's hash is the finaliser's top five bits") {
    // 0 stays 0; the others by hand, in arithmetic modulo 2^64.
    CHECK(ring_hash(0) == 0);
    CHECK(ring_hash(1) == 0x5692161d100b05e5u >> 59);
    CHECK(ring_hash(2) == 0xdbd238973a2b148au >> 59);
    // SplitMix64 from state 0 adds its constant and finishes.
    Random random(0);
    CHECK(random.next() == Random::finalised(0x9e3779b97f4a7c15u));
}

TEST_CASE("hashes are spread evenly") {
    std::array<int, 32> seen{};
    for (std::uint32_t index = 0; index < 32'000; ++index) ++seen.at(ring_hash(index));
    for (const int count : seen) CHECK((count > 850 && count < 1150));
}

TEST_CASE("a tag holds valence and sum, each modulo its size, in eight bits") {
    for (std::size_t valence = 0; valence < 40; ++valence) {
        for (unsigned sum = 0; sum < 200; ++sum) {
            const std::uint16_t tag = ring_tag(valence, sum);
            REQUIRE(tag < 256);
            REQUIRE(ring_valence(tag) == valence % 8);
            REQUIRE(ring_sum(tag) == sum % 32);
        }
    }
    CHECK(ring_tag(6, 31) == (31u << 3 | 6u));
    CHECK(ring_valence(0xffff) == 7);
    CHECK(ring_sum(0xff00) == 0);
}
