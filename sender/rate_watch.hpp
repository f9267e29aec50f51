// sender/rate_watch.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "sender/session.hpp"

namespace ellicast::sender {

/// Whether a paced stream keeps the rate that was asked for. What the socket or this machine does
/// not keep is lost time: the token bucket never makes up for it, so the stream would go on slower
/// than anyone was told. Three whole seconds in a row below nine tenths decide that it cannot be
/// kept; less may be a hiccup. Pure: moments are arguments.
class RateWatch {
  public:
    static constexpr Time kWindow = std::chrono::seconds(1);
    /// Between two looks so long apart we did not run (a stopped process, a laptop that slept), and
    /// what was not sent says nothing about the socket.
    static constexpr Time kAsleep = std::chrono::seconds(1);
    static constexpr double kShare = 0.9;
    static constexpr int kWindows = 3;

    /// 0 bits per second: unpaced, which is always kept. `datagram_bytes`: of the largest one with
    /// its headers; so much of a slow stream is sent or not within a second by chance.
    RateWatch(std::uint64_t bits_per_second, std::size_t datagram_bytes);

    /// Takes a look, a few times a second: so many bytes were sent until now, headers included.
    /// False from the moment on at which the rate is known not to be kept.
    bool look(Time now, std::uint64_t bytes);

    /// Bits per second over the windows that decided; empty while the rate is kept.
    [[nodiscard]] std::optional<double> achieved() const { return achieved_; }

  private:
    void begin(Time now, std::uint64_t bytes);
    [[nodiscard]] bool kept(Time now, std::uint64_t bytes) const;

    double bits_per_second_;
    double slack_bits_;
    struct Moment {
        Time at{};
        std::uint64_t bytes = 0;
    };
    std::optional<Time> last_look_;
    Moment window_;  // where the present window began
    Moment slow_;    // where the present row of slow windows began
    int slow_windows_ = 0;
    std::optional<double> achieved_;
};

}  // namespace ellicast::sender
