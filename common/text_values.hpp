// common/text_values.hpp: values with units and addresses, as users write them on command lines.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ellicast::common {

/// "20M" -> 20'000'000: bits per second, a decimal number with an optional decimal factor k, M or
/// G. Fractions are rounded to whole bits ("2.5k" is 2500). Throws std::invalid_argument, one line
/// that quotes the text, for anything else and for rates below 1 bit/s or above 1000 Gbit/s.
std::uint64_t parse_rate(std::string_view text);

struct Endpoint {
    std::string host;  // name or address without brackets; "" = any, or the default
    std::optional<std::uint16_t> port;  // empty = the default
    bool operator==(const Endpoint&) const = default;
};

/// "HOST:PORT", "HOST", ":PORT", "[ADDRESS]:PORT" or "[ADDRESS]". IPv6 addresses need their
/// brackets, for the last group would read as a port. Nothing is resolved. Port 0 to 65535. Throws
/// std::invalid_argument, one line that quotes the text.
Endpoint parse_endpoint(std::string_view text);

}  // namespace ellicast::common
