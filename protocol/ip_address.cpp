#include "protocol/ip_address.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <system_error>

namespace ellicast::protocol {
namespace {

constexpr std::size_t kGroups = 8;  // of 16 bits in an IPv6 address

bool read_quad(std::string_view text, std::uint8_t* bytes) {
    for (int k = 0; k < 4; ++k) {
        const std::string_view word = text.substr(0, text.find('.'));
        const char* const end = word.data() + word.size();
        const auto [stop, error] = std::from_chars(word.data(), end, bytes[k]);
        if (error != std::errc{} || stop != end || (word.size() > 1 && word[0] == '0')) {
            return false;
        }
        if (k == 3) return word.size() == text.size();
        if (word.size() == text.size()) return false;
        text.remove_prefix(word.size() + 1);
    }
    return false;
}

/// The groups as far as they were read; where "::" stood among them, if it did.
struct Groups {
    std::array<std::uint8_t, 2 * kGroups> bytes{};
    std::size_t count = 0;
    std::optional<std::size_t> gap;

    bool add(std::string_view word) {
        if (word.find('.') != std::string_view::npos) {
            if (count + 2 > kGroups || !read_quad(word, bytes.data() + 2 * count)) return false;
            count += 2;
            return true;
        }
        std::uint16_t value = 0;
        const char* const end = word.data() + word.size();
        const auto [stop, error] = std::from_chars(word.data(), end, value, 16);
        if (count == kGroups || word.size() > 4 || error != std::errc{} || stop != end) {
            return false;
        }
        bytes[2 * count] = static_cast<std::uint8_t>(value >> 8);
        bytes[2 * count + 1] = static_cast<std::uint8_t>(value & 0xff);
        ++count;
        return true;
    }
};

std::optional<Groups> read_groups(std::string_view text) {
    Groups groups;
    if (text.starts_with("::")) {
        groups.gap = 0;
        text.remove_prefix(2);
    }
    while (!text.empty()) {
        const std::string_view word = text.substr(0, text.find(':'));
        if (!groups.add(word)) return std::nullopt;
        text.remove_prefix(word.size());
        if (text.empty()) break;
        // An IPv4 address is the last of all, and a single colon is followed by something.
        if (text.size() == 1 || word.find('.') != std::string_view::npos) return std::nullopt;
        text.remove_prefix(1);
        if (text[0] != ':') continue;
        if (groups.gap) return std::nullopt;
        groups.gap = groups.count;
        text.remove_prefix(1);
    }
    const bool whole = groups.gap ? groups.count < kGroups : groups.count == kGroups;
    return whole ? std::optional(groups) : std::nullopt;
}

}  // namespace

std::optional<IpAddress> parse_ip_address(std::string_view text) {
    IpAddress address;
    if (text.find(':') == std::string_view::npos) {
        if (!read_quad(text, address.bytes.data())) return std::nullopt;
        return address;
    }
    const std::optional<Groups> groups = read_groups(text);
    if (!groups) return std::nullopt;
    address.v6 = true;
    address.bytes = groups->bytes;
    // What stands behind the gap belongs at the end.
    const auto middle = address.bytes.begin() +
                        static_cast<std::ptrdiff_t>(2 * groups->gap.value_or(groups->count));
    const auto behind = address.bytes.begin() + static_cast<std::ptrdiff_t>(2 * groups->count);
    std::rotate(middle, behind, address.bytes.end());
    return address;
}

bool is_multicast(const IpAddress& address) {
    return address.v6 ? address.bytes[0] == 0xff : (address.bytes[0] & 0xf0) == 0xe0;
}

}  // namespace ellicast::protocol
