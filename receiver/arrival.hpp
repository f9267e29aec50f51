// receiver/arrival.hpp
#pragma once

#include <array>
#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>

namespace ellicast::receiver {

/// A moment, since any fixed start, never running backwards. The cores get it as an argument; only
/// the program reads a clock.
using Time = std::chrono::nanoseconds;

/// Where a datagram came from. The cores only compare it; the endpoint alone knows what it means.
struct Source {
    std::array<std::uint8_t, 20> address{};  // IPv6 (IPv4 as mapped), then the interface's scope
    std::uint16_t port = 0;
    auto operator<=>(const Source&) const = default;
};

}  // namespace ellicast::receiver
