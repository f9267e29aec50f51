// receiver/arrival.hpp
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>

namespace ellicast::receiver {

/// A moment, since any fixed start, never running backwards. The cores get it as an argument; only
/// the program reads a clock.
using Time = std::chrono::nanoseconds;

/// When the kernel took a datagram that it stamped with its wall clock and that we read now. Never
/// before its socket was last found empty, nor after now, wherever the wall clock was set
/// meanwhile. Requires socket_empty <= now.
inline Time arrival_time(Time now, Time wall_now, Time wall_stamp, Time socket_empty) {
    return std::clamp(now - (wall_now - wall_stamp), socket_empty, now);
}

/// What keys say of a datagram. It is part of where it came from, so that what was verified and
/// what merely says so never mix.
struct Authenticity {
    std::array<std::uint8_t, 32> key{};  // that it was verified to be signed with; zeros: none
    bool is_signed = false;              // verified or not
    bool sealed = false;                 // and opened with the shared key
    [[nodiscard]] bool verified() const { return key != decltype(key){}; }
    auto operator<=>(const Authenticity&) const = default;
};

/// Where a datagram came from. The cores only compare it; the endpoint alone knows what it means.
struct Source {
    std::array<std::uint8_t, 20> address{};  // IPv6 (IPv4 as mapped), then the interface's scope
    std::uint16_t port = 0;
    Authenticity authenticity{};
    auto operator<=>(const Source&) const = default;
};

}  // namespace ellicast::receiver
