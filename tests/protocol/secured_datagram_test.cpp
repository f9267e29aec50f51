// tests/protocol/secured_datagram_test.cpp: layout of sealed and signed datagrams, and the whole
// construction against bytes worked out apart from it.
#include "protocol/secured_datagram.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "common/secure_datagram.hpp"
#include "tests/protocol/golden_datagram.hpp"
#include "tests/protocol/golden_secured.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::protocol;
using namespace ellicast::tests;

template <std::size_t N>
std::array<std::uint8_t, N> array_of(const char* hex) {
    const Bytes bytes = from_hex(hex);
    REQUIRE(bytes.size() == N);
    std::array<std::uint8_t, N> out{};
    std::ranges::copy(bytes, out.begin());
    return out;
}

const std::array<Protection, 3> kProtections{
    {{.sealed = true, .is_signed = false}, {.sealed = false, .is_signed = true}, {true, true}}};

SecurityHeader golden_security(const Protection& protection) {
    SecurityHeader header{.session_start_us = kGoldenStartUs, .sent_us = kGoldenSentUs};
    if (protection.sealed) header.counter = kGoldenCounter;
    if (protection.is_signed) header.key = array_of<8>(kGoldenKeyIdHex);
    return header;
}

/// As a sender does it, but with a counter of our own.
Bytes golden_secured(const Protection& protection) {
    Bytes bytes = make_secured(from_hex(kGoldenHex), protection, golden_security(protection));
    const auto parts = parts_of(bytes);
    if (protection.sealed) {
        const common::SessionSeal seal(common::SharedKey(array_of<32>(kGoldenSharedKeyHex)),
                                       golden_header().session);
        seal.seal(kGoldenCounter, parts.associated, parts.sections, parts.tag.first<kTagBytes>());
    }
    if (protection.is_signed) {
        const auto key = common::SigningKey::of_seed(array_of<32>(kGoldenSeedHex));
        key.sign(std::span(bytes).first(bytes.size() - kSignatureBytes),
                 parts.signature.first<kSignatureBytes>());
    }
    return bytes;
}

std::optional<WireError> fault_of(std::span<const std::uint8_t> bytes) {
    const Bytes exact(bytes.begin(), bytes.end());
    const auto view = read_secured(exact);
    if (view) return std::nullopt;
    return view.error();
}

}  // namespace

TEST_CASE("sealing and signing the golden datagram gives the golden bytes") {
    CHECK(golden_secured(kProtections[0]) == from_hex(kGoldenSealedHex));
    CHECK(golden_secured(kProtections[1]) == from_hex(kGoldenSignedHex));
    CHECK(golden_secured(kProtections[2]) == from_hex(kGoldenSealedSignedHex));
}

TEST_CASE("reading the golden secured bytes gives their fields and the golden datagram") {
    const char* const hex = GENERATE(kGoldenSealedHex, kGoldenSignedHex, kGoldenSealedSignedHex);
    const Bytes bytes = from_hex(hex);
    const Protection protection = protection_of(bytes);
    const auto view = read_secured(bytes);
    REQUIRE(view);
    CHECK(view->protection == protection);
    CHECK(view->session == golden_header().session);
    CHECK(view->security == golden_security(protection));
    CHECK(bytes.size() == from_hex(kGoldenHex).size() + security_bytes(protection));

    Bytes sections(view->parts.sections.begin(), view->parts.sections.end());
    if (protection.sealed) {
        const common::SessionSeal seal(common::SharedKey(array_of<32>(kGoldenSharedKeyHex)),
                                       view->session);
        REQUIRE(seal.open(view->security.counter, view->parts.associated, view->parts.sections,
                          view->parts.tag.first<kTagBytes>(), sections));
    }
    if (protection.is_signed) {
        CHECK(common::verifies(array_of<32>(kGoldenPublicKeyHex), view->covered,
                               view->parts.signature.first<kSignatureBytes>()));
    }
    CHECK(make_clear(*view, sections) == from_hex(kGoldenHex));
}

TEST_CASE("a secured datagram is as much longer as it says, and every part has its place") {
    CHECK(security_bytes({}) == 0);
    CHECK(security_bytes(kProtections[0]) == 36);
    CHECK(security_bytes(kProtections[1]) == 84);
    CHECK(security_bytes(kProtections[2]) == kMostSecurityBytes);
    const Bytes clear = sample_datagram();
    for (const Protection& protection : kProtections) {
        Bytes bytes = make_secured(clear, protection, golden_security(protection));
        CHECK(bytes.size() == clear.size() + security_bytes(protection));
        const auto parts = parts_of(bytes);
        CHECK(parts.associated.size() + parts.sections.size() + parts.tag.size() +
                  parts.signature.size() ==
              bytes.size());
        CHECK(std::ranges::equal(parts.sections,
                                 std::span(clear).subspan(kHeaderBytes, parts.sections.size())));
        const auto view = read_secured(bytes);
        REQUIRE(view);
        CHECK(make_clear(*view, view->parts.sections) == clear);
    }
}

TEST_CASE("clear datagrams have no protection, and the parser of clear ones takes no other") {
    CHECK_FALSE(protection_of(sample_datagram()).any());
    CHECK_FALSE(protection_of({}).any());
    CHECK_FALSE(protection_of(Bytes(13, 0xff)).any());
    for (const char* const hex : {kGoldenSealedHex, kGoldenSignedHex, kGoldenSealedSignedHex}) {
        Bytes bytes = from_hex(hex);
        CHECK(refusal_of(bytes) == WireError::unsupported_flags);
        fix_checksum(bytes);
        CHECK(refusal_of(bytes) == WireError::unsupported_flags);
    }
}

TEST_CASE("what is too short for its protection, or of another form, is refused as such") {
    for (const Protection& protection : kProtections) {
        const Bytes bytes = golden_secured(protection);
        const std::size_t least = kHeaderBytes + kTrailerBytes + security_bytes(protection);
        for (std::size_t size = 14; size < least; ++size) {
            CAPTURE(size);
            REQUIRE(fault_of(std::span(bytes).first(size)) == WireError::too_short);
        }
        CHECK(fault_of(std::span(bytes).first(least)) == std::nullopt);

        Bytes other = bytes;
        other[0] = 0x90;
        CHECK(fault_of(other) == WireError::not_rtp);
        other = bytes;
        other[12] = 2;
        CHECK(fault_of(other) == WireError::unknown_version);
        for (int bit = 3; bit < 8; ++bit) {
            other = bytes;
            other[13] = static_cast<std::uint8_t>(other[13] | 1 << bit);
            CHECK(fault_of(other) == WireError::unsupported_flags);
        }
    }
}
