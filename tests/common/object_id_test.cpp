// tests/common/object_id_test.cpp
#include "common/object_id.hpp"

#include <catch2/catch.hpp>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace ellicast::common {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

template <std::size_t N>
std::string hex(const std::array<std::uint8_t, N>& bytes) {
    std::string out;
    for (const std::uint8_t byte : bytes) {
        char pair[3];
        std::snprintf(pair, sizeof pair, "%02x", byte);
        out += pair;
    }
    return out;
}

// Values of BLAKE2b with a digest of 32 bytes, as `b2sum -l 256` prints them.
TEST_CASE("the digest is BLAKE2b with 32 bytes") {
    Digest empty;
    CHECK(hex(empty.finish32()) ==
          "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8");
    Digest abc;
    abc.update(bytes_of("abc"));
    CHECK(hex(abc.finish32()) ==
          "bddd813c634239723171ef3fee98579b94964e3bb1cb3e427262c8c068d52319");
}

TEST_CASE("the short digest is the first 8 bytes of the long one") {
    Digest abc;
    abc.update(bytes_of("abc"));
    CHECK(hex(abc.finish8()) == "bddd813c63423972");
}

TEST_CASE("pieces of any length give the digest of the whole") {
    std::string text(1000, 'x');
    for (std::size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>('a' + i * 7 % 26);
    Digest whole;
    whole.update(bytes_of(text));
    const std::array<std::uint8_t, 32> expected = whole.finish32();
    for (const std::size_t step : {1u, 3u, 127u, 128u, 129u, 999u}) {
        Digest pieces;
        for (std::size_t at = 0; at < text.size(); at += step) {
            pieces.update(bytes_of(std::string_view(text).substr(at, step)));
        }
        pieces.update({});
        CHECK(pieces.finish32() == expected);
    }
}

TEST_CASE("one changed bit changes the digest") {
    std::vector<std::uint8_t> bytes(200, 0);
    Digest first;
    first.update(bytes);
    bytes[150] ^= 1;
    Digest second;
    second.update(bytes);
    CHECK(first.finish8() != second.finish8());
}

}  // namespace
}  // namespace ellicast::common
