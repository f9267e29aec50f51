// tests/protocol/refusal_test.cpp: damage to a whole datagram, and what is refused for which
// reason.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "protocol/crc32c.hpp"
#include "protocol/datagram.hpp"
#include "tests/protocol/golden_datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
using Fault = std::optional<WireError>;

/// The reason for a header changed in this way.
Fault with_header(const std::function<void(DatagramHeader&)>& change) {
    DatagramHeader header = sample_header();
    change(header);
    Random random(1);
    DatagramWriter writer(header, kMinDatagramBytes);
    writer.add_vertices(0, 1, random_vertices(1, sample_header().hint, random));
    return refusal_of(writer.finish());
}

Fault with_hint(const std::function<void(Hint&)>& change) {
    return with_header([&](DatagramHeader& header) { change(header.hint); });
}

/// The reason for a byte changed in this way, checksum right.
Fault with_byte(std::size_t offset, std::uint8_t value) {
    Bytes bytes = sample_datagram();
    bytes[offset] = value;
    fix_checksum(bytes);
    return refusal_of(bytes);
}

}  // namespace

TEST_CASE("every proper prefix of a datagram is refused, whatever its checksum") {
    for (const Bytes& whole : {sample_datagram(), from_hex(kGoldenHex)}) {
        REQUIRE_FALSE(refusal_of(whole));
        for (std::size_t size = 0; size < whole.size(); ++size) {
            CAPTURE(size);
            const std::span<const std::uint8_t> prefix(whole.data(), size);
            const Fault expected = size < kHeaderBytes + kTrailerBytes ? WireError::too_short
                                                                       : WireError::bad_checksum;
            REQUIRE(refusal_of(prefix) == expected);
        }
    }
}

TEST_CASE(
    "a datagram cut anywhere and sealed with a right checksum is refused unless cut between "
    "sections") {
    const Bytes whole = from_hex(kGoldenHex);
    for (std::size_t size = kHeaderBytes; size < whole.size() - kTrailerBytes; ++size) {
        CAPTURE(size);
        Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
        cut.resize(size + kTrailerBytes);
        fix_checksum(cut);
        const bool between = size == 132 || size == 181;  // behind the description, the ellipsoid
        REQUIRE(refusal_of(cut) == (between ? Fault{} : Fault{WireError::bad_section}));
    }
}

TEST_CASE("a datagram with one byte more is refused") {
    for (int byte = 0; byte < 256; ++byte) {
        Bytes bytes = sample_datagram();
        bytes.push_back(static_cast<std::uint8_t>(byte));
        REQUIRE(refusal_of(bytes) == WireError::bad_checksum);
        fix_checksum(bytes);
        REQUIRE(refusal_of(bytes) == WireError::bad_section);
    }
}

TEST_CASE("every single flipped bit is refused") {
    Bytes bytes = sample_datagram();
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << bit % 8));
        CAPTURE(bit);
        REQUIRE(refusal_of(bytes));
        bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << bit % 8));
    }
    REQUIRE_FALSE(refusal_of(bytes));
}

TEST_CASE("random bytes are refused, also behind a right beginning and before a right end") {
    Random random(11);
    for (int round = 0; round < 20'000; ++round) {
        CAPTURE(round);
        Bytes bytes(random.below(300));
        for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
        REQUIRE(refusal_of(bytes));
        if (bytes.size() < kHeaderBytes + kTrailerBytes) continue;
        const Bytes good = sample_datagram();
        const std::size_t right = random.below(kHeaderBytes + 1);
        std::copy_n(good.begin(), right, bytes.begin());
        fix_checksum(bytes);
        REQUIRE(refusal_of(bytes));
    }
}

TEST_CASE("what is not plain RTP version 2 is refused as such") {
    for (const int byte : {0x00, 0x40, 0xc0, 0xa0, 0x90, 0x81, 0x8f}) {
        CHECK(with_byte(0, static_cast<std::uint8_t>(byte)) == WireError::not_rtp);
    }
    CHECK_FALSE(with_byte(1, 0x7f));  // any payload type, no marker
}

TEST_CASE("every other version is refused as unknown") {
    for (int version = 0; version < 256; ++version) {
        const Fault fault = with_byte(12, static_cast<std::uint8_t>(version));
        CHECK(fault == (version == 1 ? Fault{} : Fault{WireError::unknown_version}));
    }
}

TEST_CASE("every flag but approximate is refused") {
    for (int flags = 0; flags < 256; ++flags) {
        const Fault fault = with_byte(13, static_cast<std::uint8_t>(flags));
        CHECK(fault == (flags < 2 ? Fault{} : Fault{WireError::unsupported_flags}));
    }
}

TEST_CASE("a version or flag that is not ours is told before the checksum") {
    Bytes bytes = sample_datagram();
    bytes[12] = 2;
    CHECK(refusal_of(bytes) == WireError::unknown_version);
    bytes[12] = 1;
    bytes[13] = 0x02;  // sealed: no checksum of ours stands at its end
    CHECK(refusal_of(bytes) == WireError::unsupported_flags);
}

TEST_CASE("a box that is not finite, turned round, empty or absurd is a bad hint") {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const float bad : {kNan, kInfinity, -kInfinity, 1.1e30f, -1.1e30f}) {
            CAPTURE(axis, bad);
            CHECK(with_hint([&](Hint& h) { h.box_min[axis] = bad; }) == WireError::bad_hint);
            CHECK(with_hint([&](Hint& h) { h.box_max[axis] = bad; }) == WireError::bad_hint);
        }
        CHECK(with_hint([&](Hint& h) { std::swap(h.box_min[axis], h.box_max[axis]); }) ==
              WireError::bad_hint);
    }
    CHECK(with_hint([](Hint& h) { h.box_max = h.box_min; }) == WireError::bad_hint);
    CHECK(with_hint([](Hint& h) {
              h.box_min = {0.0f, 0.0f, 0.0f};
              h.box_max = {0.9e-30f, 0.0f, 0.0f};
          }) == WireError::bad_hint);
}

TEST_CASE("a flat box and one at the limits are good hints") {
    Hint hint = sample_header().hint;
    hint.box_min[2] = hint.box_max[2];
    CHECK(acceptable(hint));
    hint.box_min = {-1e30f, -1e30f, -1e30f};
    hint.box_max = {1e30f, 1e30f, 1e30f};
    CHECK(acceptable(hint));
    hint.box_min = {0.0f, 0.0f, 0.0f};
    hint.box_max = {1.01e-30f, 0.0f, 0.0f};
    CHECK(acceptable(hint));
}

TEST_CASE("counts beyond their limits are bad hints") {
    CHECK(with_hint([](Hint& h) { h.components = 0; }) == WireError::bad_hint);
    CHECK(with_hint([](Hint& h) { h.components = kMaxComponents + 1; }) == WireError::bad_hint);
    CHECK_FALSE(with_hint([](Hint& h) { h.components = kMaxComponents; }));
    CHECK(with_hint([](Hint& h) { h.vertices = kMaxVertices + 1; }) == WireError::bad_hint);
    CHECK_FALSE(with_hint([](Hint& h) { h.vertices = kMaxVertices; }));
    CHECK(with_hint([](Hint& h) { h.ellipsoids = 0, h.vertices = 0; }) == WireError::bad_hint);
    CHECK_FALSE(with_hint([](Hint& h) { h.ellipsoids = 0; }));
    CHECK_FALSE(with_hint([](Hint& h) { h.ellipsoids = 65'535; }));
}

TEST_CASE("a topology that no closed surface has is a bad hint") {
    const auto with_topology = [](std::uint32_t components, std::int32_t all,
                                  std::int32_t largest) {
        return with_hint([&](Hint& h) {
            h.components = components;
            h.euler_all = all;
            h.euler_largest = largest;
        });
    };
    CHECK(with_topology(1, 3, 2) == WireError::bad_hint);   // odd
    CHECK(with_topology(2, 2, 1) == WireError::bad_hint);   // odd
    CHECK(with_topology(3, 6, 4) == WireError::bad_hint);   // no surface has more than 2
    CHECK(with_topology(2, 6, 2) == WireError::bad_hint);   // more than all can have
    CHECK(with_topology(1, 0, 2) == WireError::bad_hint);   // one component, two opinions
    CHECK(with_topology(2, 4, -2) == WireError::bad_hint);  // the other would have 6
    CHECK_FALSE(with_topology(1, -6, -6));
    CHECK_FALSE(with_topology(2, 4, 2));
    CHECK_FALSE(with_topology(2, -4, 2));  // a small part with handles
    CHECK_FALSE(with_topology(1, std::numeric_limits<std::int32_t>::min(),
                              std::numeric_limits<std::int32_t>::min()));
}

TEST_CASE("an unknown diagonal rule is a bad hint") {
    constexpr std::size_t kFormatOffset = 72;
    for (int byte = 0; byte < 256; ++byte) {
        if ((byte >> 4) % 8 < kDiagonalRules) continue;
        CAPTURE(byte);
        const auto code = static_cast<std::uint8_t>(byte);
        CHECK(with_byte(kFormatOffset, code) == WireError::bad_hint);
        CHECK_FALSE(RecordFormat::of_code(code).is_known());
    }
}

TEST_CASE("every diagonal rule arrives, whatever the record format") {
    for (std::uint8_t rule = 0; rule < kDiagonalRules; ++rule) {
        CHECK(with_hint([&](Hint& h) { h.diagonals = rule; }) == std::nullopt);
        CHECK(with_hint([&](Hint& h) { h.diagonals = rule, h.by_importance = true; }) ==
              std::nullopt);
    }
}

TEST_CASE("a round or ordinal that is not below its number is a bad round") {
    CHECK(with_header([](DatagramHeader& h) { h.round = h.rounds; }) == WireError::bad_round);
    CHECK(with_header([](DatagramHeader& h) { h.ordinal = h.datagrams; }) == WireError::bad_round);
    CHECK(with_header([](DatagramHeader& h) { h.datagrams = 0, h.ordinal = 0; }) ==
          WireError::bad_round);
    CHECK_FALSE(with_header([](DatagramHeader& h) { h.rounds = 0, h.round = 0xffffffffu; }));
    CHECK_FALSE(with_header([](DatagramHeader& h) { h.round = h.rounds - 1; }));
    CHECK_FALSE(with_header([](DatagramHeader& h) { h.ordinal = h.datagrams - 1; }));
}
