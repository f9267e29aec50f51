// tests/protocol/crc32c_test.cpp
#include "protocol/crc32c.hpp"

#include <catch2/catch.hpp>
#include <numeric>
#include <string_view>
#include <vector>

#include "common/random.hpp"

namespace {

using ellicast::common::Random;
using ellicast::protocol::crc32c;
using ellicast::protocol::crc32c_by_table;
using Bytes = std::vector<std::uint8_t>;

/// The definition, bit by bit.
std::uint32_t plain_crc32c(const Bytes& bytes) {
    std::uint32_t crc = ~0u;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0x82f63b78u : 0u);
        }
    }
    return ~crc;
}

}  // namespace

TEST_CASE("CRC-32C agrees with the examples of RFC 3720 B.4") {
    Bytes rising(32);
    std::iota(rising.begin(), rising.end(), std::uint8_t{0});
    const Bytes falling(rising.rbegin(), rising.rend());
    CHECK(crc32c(Bytes(32, 0x00)) == 0x8a9136aau);
    CHECK(crc32c(Bytes(32, 0xff)) == 0x62a8ab43u);
    CHECK(crc32c(rising) == 0x46dd794eu);
    CHECK(crc32c(falling) == 0x113fdb5cu);
    constexpr std::string_view kDigits = "123456789";
    CHECK(crc32c(Bytes(kDigits.begin(), kDigits.end())) == 0xe3069283u);
    CHECK(crc32c({}) == 0u);
}

TEST_CASE("CRC-32C follows its definition at every length and alignment") {
    Random random(1);
    Bytes pool(3000);
    for (auto& byte : pool) byte = static_cast<std::uint8_t>(random.next());
    for (std::size_t length = 0; length < 2500; length += length < 100 ? 1 : 37) {
        for (std::size_t start = 0; start < 9; ++start) {
            CAPTURE(length, start);
            const auto from = pool.begin() + static_cast<std::ptrdiff_t>(start);
            const Bytes part(from, from + static_cast<std::ptrdiff_t>(length));
            const auto here = std::span(pool).subspan(start, length);
            REQUIRE(crc32c(here) == plain_crc32c(part));
            REQUIRE(crc32c_by_table(here) == plain_crc32c(part));
        }
    }
}
