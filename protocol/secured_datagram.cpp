// protocol/secured_datagram.cpp
#include "protocol/secured_datagram.hpp"

#include <algorithm>
#include <cassert>

#include "protocol/byte_reader.hpp"
#include "protocol/byte_writer.hpp"
#include "protocol/crc32c.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kTimesBytes = 16;
constexpr std::size_t kCounterBytes = 8;

std::size_t header_bytes(const Protection& protection) {
    return kTimesBytes + (protection.sealed ? kCounterBytes : 0) +
           (protection.is_signed ? sizeof(KeyId) : 0);
}

std::size_t trailer_bytes(const Protection& protection) {
    return (protection.sealed ? kTagBytes : 0) + (protection.is_signed ? kSignatureBytes : 0);
}

static_assert(kLeastCapacity + kMostSecurityBytes == kMinDatagramBytes);
static_assert(kMostSecurityBytes == kTimesBytes + kCounterBytes + sizeof(KeyId) + kTagBytes +
                                        kSignatureBytes - kTrailerBytes);

/// Requires header and trailer of the protection.
template <class Byte>
SecuredParts<Byte> split(std::span<Byte> bytes, const Protection& protection) {
    SecuredParts<Byte> parts;
    const std::size_t front = kHeaderBytes + header_bytes(protection);
    const std::size_t back = trailer_bytes(protection);
    parts.associated = bytes.first(front);
    parts.sections = bytes.subspan(front, bytes.size() - front - back);
    const auto trailer = bytes.last(back);
    if (protection.sealed) parts.tag = trailer.first(kTagBytes);
    if (protection.is_signed) parts.signature = trailer.last(kSignatureBytes);
    return parts;
}

SecurityHeader read_security(Bytes bytes, const Protection& protection) {
    const std::uint8_t* p = bytes.data();
    SecurityHeader security;
    security.session_start_us = load_u64(p);
    security.sent_us = load_u64(p + 8);
    p += kTimesBytes;
    if (protection.sealed) {
        security.counter = load_u64(p);
        p += kCounterBytes;
    }
    if (protection.is_signed) std::copy_n(p, security.key.size(), security.key.begin());
    return security;
}

void write_security(FixedWriter& writer, const SecurityHeader& security,
                    const Protection& protection) {
    writer.u64(security.session_start_us);
    writer.u64(security.sent_us);
    if (protection.sealed) writer.u64(security.counter);
    if (protection.is_signed) writer.bytes(security.key);
}

}  // namespace

std::size_t security_bytes(const Protection& protection) {
    if (!protection.any()) return 0;
    return header_bytes(protection) + trailer_bytes(protection) - kTrailerBytes;
}

Protection protection_of(std::span<const std::uint8_t> datagram) {
    if (datagram.size() <= kFlagsOffset) return {};
    const std::uint8_t flags = datagram[kFlagsOffset];
    return {.sealed = (flags & kFlagSealed) != 0, .is_signed = (flags & kFlagSigned) != 0};
}

Result<SecuredView, WireError> read_secured(std::span<const std::uint8_t> bytes) {
    SecuredView view;
    view.protection = protection_of(bytes);
    assert(view.protection.any());
    const std::size_t least =
        kHeaderBytes + header_bytes(view.protection) + trailer_bytes(view.protection);
    if (bytes.size() < least) return WireError::too_short;
    if (bytes[0] != kRtpVersion << 6) return WireError::not_rtp;
    if (bytes[kVersionOffset] != kWireVersion) return WireError::unknown_version;
    constexpr std::uint8_t kKnown = kFlagApproximate | kFlagSealed | kFlagSigned;
    if ((bytes[kFlagsOffset] & ~kKnown) != 0) return WireError::unsupported_flags;
    view.parts = split(bytes, view.protection);
    std::ranges::copy(bytes.subspan(kSessionOffset, view.session.size()), view.session.begin());
    view.security = read_security(bytes.subspan(kHeaderBytes), view.protection);
    view.covered = bytes.first(bytes.size() - view.parts.signature.size());
    return view;
}

std::vector<std::uint8_t> make_secured(std::span<const std::uint8_t> clear,
                                       const Protection& protection,
                                       const SecurityHeader& security) {
    assert(protection.any() && clear.size() >= kHeaderBytes + kTrailerBytes);
    const Bytes header = clear.first(kHeaderBytes);
    const Bytes sections = clear.subspan(kHeaderBytes, clear.size() - kHeaderBytes - kTrailerBytes);
    std::vector<std::uint8_t> out(clear.size() + security_bytes(protection));
    FixedWriter writer(out);
    writer.bytes(header);
    out[kFlagsOffset] =
        static_cast<std::uint8_t>(out[kFlagsOffset] | (protection.sealed ? kFlagSealed : 0) |
                                  (protection.is_signed ? kFlagSigned : 0));
    write_security(writer, security, protection);
    writer.bytes(sections);
    assert(writer.left() == trailer_bytes(protection));
    return out;
}

SecuredParts<std::uint8_t> parts_of(std::span<std::uint8_t> secured) {
    return split(secured, protection_of(secured));
}

std::vector<std::uint8_t> make_clear(const SecuredView& secured,
                                     std::span<const std::uint8_t> sections) {
    std::vector<std::uint8_t> out(kHeaderBytes + sections.size() + kTrailerBytes);
    FixedWriter writer(out);
    writer.bytes(secured.parts.associated.first(kHeaderBytes));
    out[kFlagsOffset] &= kFlagApproximate;
    writer.bytes(sections);
    writer.u32(crc32c(std::span(out).first(out.size() - kTrailerBytes)));
    return out;
}

}  // namespace ellicast::protocol
