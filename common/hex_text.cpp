// common/hex_text.cpp
#include "common/hex_text.hpp"

#include <cassert>

namespace ellicast::common {
namespace {

std::optional<std::uint8_t> digit(char c) {
    if (c >= '0' && c <= '9') return static_cast<std::uint8_t>(c - '0');
    if (c >= 'a' && c <= 'f') return static_cast<std::uint8_t>(c - 'a' + 10);
    if (c >= 'A' && c <= 'F') return static_cast<std::uint8_t>(c - 'A' + 10);
    return std::nullopt;
}

}  // namespace

std::string hex_text(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : bytes) {
        text += kDigits[byte >> 4];
        text += kDigits[byte & 15];
    }
    return text;
}

bool read_hex(std::string_view text, std::span<std::uint8_t> bytes) {
    assert(text.size() == 2 * bytes.size());
    for (std::size_t k = 0; k < bytes.size(); ++k) {
        const auto high = digit(text[2 * k]);
        const auto low = digit(text[2 * k + 1]);
        if (!high || !low) return false;
        bytes[k] = static_cast<std::uint8_t>(*high << 4 | *low);
    }
    return true;
}

}  // namespace ellicast::common
