// common/text_values.cpp
#include "common/text_values.hpp"

#include <algorithm>
#include <cmath>

#include "common/number_text.hpp"

namespace ellicast::common {
namespace {

constexpr double kMaxBitsPerSecond =
    1e12;  // beyond any interface of our day; keeps products in range

double factor_of(char unit) {
    switch (unit) {
        case 'k':
            return 1e3;
        case 'M':
            return 1e6;
        case 'G':
            return 1e9;
        default:
            return 0.0;  // no unit
    }
}

std::uint16_t parse_port(std::string_view word, std::string_view text) {
    const auto port = number<std::uint16_t>(word);
    if (!port) throw refusal(text, "the port is not a number from 0 to 65535");
    return *port;
}

Endpoint parse_bracketed(std::string_view text) {
    const std::size_t close = text.find(']');
    if (close == std::string_view::npos) throw refusal(text, "']' is missing");
    if (close == 1) throw refusal(text, "no address between the brackets");
    Endpoint endpoint{std::string(text.substr(1, close - 1)), std::nullopt};
    const std::string_view rest = text.substr(close + 1);
    if (rest.empty()) return endpoint;
    if (rest[0] != ':') throw refusal(text, "expected ':' behind ']'");
    endpoint.port = parse_port(rest.substr(1), text);
    return endpoint;
}

/// No host name and no address holds white space, control characters or a second bracket.
bool is_host_text(std::string_view host) {
    return std::ranges::all_of(host, [](char c) { return c > ' ' && c != '\x7f' && c != '['; });
}

}  // namespace

std::uint64_t parse_rate(std::string_view text) {
    std::string_view digits = text;
    double factor = text.empty() ? 0.0 : factor_of(text.back());
    if (factor > 0.0) {
        digits.remove_suffix(1);
    } else {
        factor = 1.0;
    }
    const auto value = number<double>(digits);
    if (!value) throw refusal(text, "expected a rate such as 500k, 20M or 1G (bits per second)");
    const double bits = *value * factor;
    if (!(bits >= 1.0 && bits <= kMaxBitsPerSecond)) {
        throw refusal(text, "the rate is not between 1 bit/s and 1000G");
    }
    return static_cast<std::uint64_t>(std::llround(bits));
}

Endpoint parse_endpoint(std::string_view text) {
    if (text.empty()) throw refusal(text, "expected HOST:PORT, [IPV6]:PORT, :PORT or HOST");
    Endpoint endpoint;
    if (text[0] == '[') {
        endpoint = parse_bracketed(text);
    } else {
        const std::size_t colon = text.find(':');
        if (colon != std::string_view::npos) {
            if (text.find(':', colon + 1) != std::string_view::npos) {
                throw refusal(text, "an IPv6 address needs brackets, as in [::1]:5004");
            }
            endpoint.port = parse_port(text.substr(colon + 1), text);
        }
        endpoint.host = text.substr(0, colon);
    }
    if (!is_host_text(endpoint.host)) throw refusal(text, "the host holds a forbidden character");
    return endpoint;
}

}  // namespace ellicast::common
