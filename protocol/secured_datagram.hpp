// protocol/secured_datagram.hpp: where a sealed or signed datagram keeps what; WIRE_FORMAT.md
// section 13. No cryptography is here: it fills and checks the places that this shows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/datagram.hpp"
#include "protocol/result.hpp"

namespace ellicast::protocol {

inline constexpr std::size_t kTagBytes = 16;        // XChaCha20-Poly1305
inline constexpr std::size_t kSignatureBytes = 64;  // Ed25519
inline constexpr std::size_t kMostSecurityBytes = 108;

/// First bytes of the digest of a public key; finds the key, proves nothing.
using KeyId = std::array<std::uint8_t, 8>;

/// What stands where a clear datagram has its checksum.
struct Protection {
    bool sealed = false;     // sections are encrypted, and a tag stands behind them
    bool is_signed = false;  // a signature ends the datagram
    [[nodiscard]] bool any() const { return sealed || is_signed; }
    bool operator==(const Protection&) const = default;
};

/// Bytes by which a datagram is larger than the clear one with the same sections; 0 to
/// kMostSecurityBytes.
std::size_t security_bytes(const Protection& protection);

/// What the datagram's flags say, without any check; nothing when there are none.
Protection protection_of(std::span<const std::uint8_t> datagram);

/// Stands between header and sections, in clear.
struct SecurityHeader {
    std::uint64_t session_start_us = 0;  // microseconds since 1970-01-01 00:00 UTC
    std::uint64_t sent_us = 0;           // likewise
    std::uint64_t counter = 0;           // of the session's sealed datagrams; only when sealed
    KeyId key{};                         // of the public key; only when signed
    bool operator==(const SecurityHeader&) const = default;
};

/// Parts of a secured datagram; `Byte` is const or not. What its protection leaves out is empty.
template <class Byte>
struct SecuredParts {
    std::span<Byte> associated;  // header and security header
    std::span<Byte> sections;    // their ciphertext, when sealed
    std::span<Byte> tag;
    std::span<Byte> signature;  // covers all that is before it
};

/// A datagram whose outer form is right; nothing of it is believed yet.
struct SecuredView {
    Protection protection;
    SessionId session{};
    SecurityHeader security;
    SecuredParts<const std::uint8_t> parts;
    std::span<const std::uint8_t> covered;  // by the signature; all of it without one
};

/// Checks length, RTP version, version and flags, in the order and under the names of
/// WIRE_FORMAT.md section 6. Requires protection_of(bytes).any() (asserted). Constant time, no
/// allocation.
Result<SecuredView, WireError> read_secured(std::span<const std::uint8_t> bytes);

/// Opens a place for everything in a clear datagram: flags set, security header in, checksum gone,
/// sections still in clear, tag and signature zero. Requires protection.any() and at least header
/// and trailer (asserted). One copy of the bytes.
std::vector<std::uint8_t> make_secured(std::span<const std::uint8_t> clear,
                                       const Protection& protection,
                                       const SecurityHeader& security);

/// Of a datagram that make_secured or read_secured knows.
SecuredParts<std::uint8_t> parts_of(std::span<std::uint8_t> secured);

/// The clear datagram: the header without its flags of protection, these sections, the checksum
/// made anew. It is what parse_datagram takes.
std::vector<std::uint8_t> make_clear(const SecuredView& secured,
                                     std::span<const std::uint8_t> sections);

}  // namespace ellicast::protocol
