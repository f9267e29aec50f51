#include "common/secure_datagram.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "common/random.hpp"

namespace {

using namespace ellicast::common;
using Bytes = std::vector<std::uint8_t>;
using Tag = std::array<std::uint8_t, kSealTagBytes>;
using Signature = std::array<std::uint8_t, kSignatureBytes>;

Bytes some_bytes(std::size_t count, std::uint64_t seed = 1) {
    Random random(seed);
    Bytes bytes(count);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    return bytes;
}

SigningKey key_of(std::uint8_t seed) {
    return SigningKey::of_seed({seed, 7});
}

Signature signed_by(const SigningKey& key, ConstBytes message) {
    Signature signature{};
    key.sign(message, signature);
    return signature;
}

void flip(std::span<std::uint8_t> bytes, std::size_t bit) {
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1 << bit % 8);
}

constexpr SessionBytes kSession{1, 2, 3, 4, 5, 6, 7, 8};

struct Sealed {
    Bytes associated = some_bytes(113, 2);
    Bytes body = some_bytes(200, 3);
    Tag tag{};
};

Sealed sealed_by(const SessionSeal& seal, std::uint64_t counter = 5) {
    Sealed sealed;
    seal.seal(counter, sealed.associated, sealed.body, sealed.tag);
    return sealed;
}

bool opens(const SessionSeal& seal, const Sealed& sealed, std::uint64_t counter = 5) {
    Bytes body(sealed.body.size());
    return seal.open(counter, sealed.associated, sealed.body, sealed.tag, body);
}

}  // namespace

TEST_CASE("a signature holds for its message and key, and for not one bit else") {
    const SigningKey key = key_of(1);
    Bytes message = some_bytes(120);
    Signature signature = signed_by(key, message);
    REQUIRE(verifies(key.public_key(), message, signature));
    CHECK_FALSE(verifies(key_of(2).public_key(), message, signature));
    for (std::size_t bit = 0; bit < 8 * message.size(); ++bit) {
        flip(message, bit);
        REQUIRE_FALSE(verifies(key.public_key(), message, signature));
        flip(message, bit);
    }
    for (std::size_t bit = 0; bit < 8 * signature.size(); ++bit) {
        CAPTURE(bit);
        flip(signature, bit);
        REQUIRE_FALSE(verifies(key.public_key(), message, signature));
        flip(signature, bit);
    }
    CHECK_FALSE(verifies(key.public_key(), std::span(message).first(119), signature));
    message.push_back(0);
    CHECK_FALSE(verifies(key.public_key(), message, signature));
}

TEST_CASE("a signature in another form of the same number is refused") {
    // The order of the group, little-endian [RFC 8032]; s + order is the same scalar.
    constexpr std::array<std::uint8_t, 32> kOrder{0xed, 0xd3, 0xf5, 0x5c, 0x1a, 0x63, 0x12, 0x58,
                                                  0xd6, 0x9c, 0xf7, 0xa2, 0xde, 0xf9, 0xde, 0x14,
                                                  0,    0,    0,    0,    0,    0,    0,    0,
                                                  0,    0,    0,    0,    0,    0,    0,    0x10};
    const SigningKey key = key_of(1);
    const Bytes message = some_bytes(50);
    Signature signature = signed_by(key, message);
    unsigned carry = 0;
    for (std::size_t k = 0; k < 32; ++k) {
        carry += unsigned{signature[32 + k]} + kOrder[k];
        signature[32 + k] = static_cast<std::uint8_t>(carry);
        carry >>= 8;
    }
    REQUIRE(carry == 0);
    CHECK_FALSE(verifies(key.public_key(), message, signature));
}

TEST_CASE("a public key of small order verifies nothing") {
    // With the neutral element as key and R, and s = 0, the equation holds for every message.
    Signature signature{1};
    CHECK_FALSE(verifies(PublicKey{1}, some_bytes(50), signature));
    CHECK_FALSE(verifies(PublicKey{}, some_bytes(50), Signature{}));
}

TEST_CASE("private keys are whole or not taken at all") {
    const SigningKey key = key_of(3);
    auto bytes = key.bytes();
    const auto again = SigningKey::of_bytes(bytes);
    REQUIRE(again);
    CHECK(again->public_key() == key.public_key());
    for (const std::size_t bit : {0u, 255u, 256u, 511u}) {
        flip(bytes, bit);
        CHECK_FALSE(SigningKey::of_bytes(bytes));
        flip(bytes, bit);
    }
}

TEST_CASE("random keys differ") {
    CHECK(SigningKey::random().bytes() != SigningKey::random().bytes());
    CHECK(SharedKey::random().bytes() != SharedKey::random().bytes());
    CHECK(key_id(SigningKey::random().public_key()) != key_id(SigningKey::random().public_key()));
}

TEST_CASE("what was sealed opens with its key, session and counter alone") {
    const SharedKey key({1, 2, 3});
    const SessionSeal seal(key, kSession);
    const Sealed sealed = sealed_by(seal);
    CHECK(sealed.body != Sealed{}.body);
    Bytes body(sealed.body.size());
    REQUIRE(seal.open(5, sealed.associated, sealed.body, sealed.tag, body));
    CHECK(body == Sealed{}.body);

    CHECK_FALSE(opens(seal, sealed, 4));
    CHECK_FALSE(opens(SessionSeal(SharedKey({1, 2, 4}), kSession), sealed));
    SessionBytes other = kSession;
    other[7] ^= 1;
    CHECK_FALSE(opens(SessionSeal(key, other), sealed));
}

TEST_CASE("no bit of what was sealed, of the tag, or of what goes with it can change") {
    const SessionSeal seal(SharedKey({1, 2, 3}), kSession);
    Sealed sealed = sealed_by(seal);
    for (const std::span<std::uint8_t> part : {std::span(sealed.associated), std::span(sealed.body),
                                               std::span<std::uint8_t>(sealed.tag)}) {
        for (std::size_t bit = 0; bit < 8 * part.size(); ++bit) {
            flip(part, bit);
            REQUIRE_FALSE(opens(seal, sealed));
            flip(part, bit);
        }
    }
    REQUIRE(opens(seal, sealed));
    sealed.body.pop_back();
    CHECK_FALSE(opens(seal, sealed));
}

TEST_CASE("sessions and counters encrypt the same differently") {
    const SharedKey key({9});
    const SessionSeal seal(key, kSession);
    const Sealed first = sealed_by(seal, 0);
    CHECK(first.body != sealed_by(seal, 1).body);
    CHECK(first.body != sealed_by(seal, std::uint64_t{1} << 63).body);
    CHECK(first.body != sealed_by(SessionSeal(key, {}), 0).body);
    CHECK(first.body == sealed_by(seal, 0).body);
}

TEST_CASE("a fingerprint tells keys apart and is not the key of any session") {
    CHECK(SharedKey({1}).fingerprint() == SharedKey({1}).fingerprint());
    CHECK(SharedKey({1}).fingerprint() != SharedKey({2}).fingerprint());
    CHECK(SharedKey({1}).fingerprint() != SharedKey({1}).bytes());
}

TEST_CASE("wiped bytes are gone") {
    std::array<std::uint8_t, 5> bytes{1, 2, 3, 4, 5};
    wipe(bytes);
    CHECK(bytes == std::array<std::uint8_t, 5>{});
}
