// protocol/wire_layout.hpp: where things stand in a datagram; WIRE_FORMAT.md sections 3 to 5.
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/datagram.hpp"

namespace ellicast::protocol {

inline constexpr std::uint8_t kRtpVersion = 2;
inline constexpr std::size_t kRtpBytes = 12;
inline constexpr std::size_t kSequenceOffset = 2;
inline constexpr std::size_t kTimestampOffset = 4;
inline constexpr std::size_t kVersionOffset = 12;
inline constexpr std::size_t kFlagsOffset = 13;
inline constexpr std::size_t kSessionOffset = 14;
inline constexpr std::size_t kHintOffset = 30;
inline constexpr std::size_t kHintBytes = 43;
inline constexpr std::size_t kRoundOffset = 73;

inline constexpr std::uint8_t kFlagApproximate = 0x01;
inline constexpr std::uint8_t kFlagSealed = 0x02;
inline constexpr std::uint8_t kFlagSigned = 0x04;
// All other bits are refused; so are these two by parse_datagram, which reads clear datagrams
// alone.

inline constexpr std::size_t kKindAndLengthBytes = 3;  // in front of every section's body
inline constexpr std::size_t kIndexBytes = 10;         // count, first, stride in front of records
inline constexpr std::size_t kMaxStringBytes = 255;

static_assert(kHintOffset == kRtpBytes + 2 + sizeof(SessionId) + sizeof(ObjectId));
static_assert(kRoundOffset == kHintOffset + kHintBytes);
static_assert(kHeaderBytes == kRoundOffset + 16);
static_assert(kSectionHeaderBytes == kKindAndLengthBytes + kIndexBytes);
static_assert(kCanonicalHintBytes == kHintBytes + 1);

}  // namespace ellicast::protocol
