// protocol/ip_address.hpp: numeric addresses as texts, where no socket is near.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string_view>

namespace ellicast::protocol {

struct IpAddress {
    bool v6 = false;
    std::array<std::uint8_t, 16> bytes{};  // in network order; of IPv4 the first four, else zeros
    auto operator<=>(const IpAddress&) const = default;
};

/// "192.0.2.7" or "2001:db8::7" [RFC 4291 section 2.2], the last 32 bits also as IPv4. Takes just
/// what inet_pton takes: no zones, brackets, blanks, leading zeros of IPv4. Nothing is resolved.
std::optional<IpAddress> parse_ip_address(std::string_view text);

/// 224.0.0.0/4 and ff00::/8.
bool is_multicast(const IpAddress& address);

}  // namespace ellicast::protocol
