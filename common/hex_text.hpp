// common/hex_text.hpp: bytes as hexadecimal digits, two a byte, and back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ellicast::common {

/// Lower case.
std::string hex_text(std::span<const std::uint8_t> bytes);

/// False when there is anything but hex digits. Requires two for each byte (asserted).
bool read_hex(std::string_view text, std::span<std::uint8_t> bytes);

/// The bytes of exactly 2 N hex digits, of either case.
template <std::size_t N>
std::optional<std::array<std::uint8_t, N>> bytes_of_hex(std::string_view text) {
    std::array<std::uint8_t, N> bytes{};
    if (text.size() != 2 * N || !read_hex(text, bytes)) return std::nullopt;
    return bytes;
}

}  // namespace ellicast::common
