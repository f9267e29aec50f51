// protocol/crc32c.hpp
#pragma once

#include <cstdint>
#include <span>

namespace ellicast::protocol {

/// CRC-32C (Castagnoli) of the bytes, as [RFC 3720] appendix B.4 counts it: reflected polynomial
/// 0x82f63b78, start and final xor all ones; "123456789" gives 0xe3069283. Linear in the bytes.
/// Uses the processor's own instruction where there is one.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::uint8_t> bytes);

/// The same, on every machine; about eight times slower.
[[nodiscard]] std::uint32_t crc32c_by_table(std::span<const std::uint8_t> bytes);

}  // namespace ellicast::protocol
