// common/token_bucket.hpp
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace ellicast::common {

/// Paces a stream to an exact rate. Time is an argument, from any epoch. A datagram may leave when
/// the debt of those before it is paid, and then adds its own bits to the debt: under steady demand
/// the k-th leaves at the sum of the earlier ones' bits / rate, to the nanosecond above, for sizes
/// of any kind. Who comes late has credit for at most `burst` of time, so that in any stretch of T
/// seconds at most rate * (T + burst) bits leave, and one datagram. Integers throughout: no drift,
/// no dependence on how often it is asked.
class TokenBucket {
  public:
    using Time = std::chrono::nanoseconds;  // since any epoch

    /// Requires 1 <= bits_per_second <= 10^12 and 0 <= burst <= 1 s (asserted). The first datagram
    /// may leave at once.
    TokenBucket(std::uint64_t bits_per_second, Time burst);

    /// Takes `bytes` from the bucket and gives true when a datagram may leave at `now`; else
    /// nothing changes. A time before an earlier one counts as that one. Requires bytes <= 2^20
    /// (asserted).
    [[nodiscard]] bool take(Time now, std::size_t bytes);

    /// The earliest time at which take() gives true, in the past when it would at once; Time::min()
    /// before the first.
    [[nodiscard]] Time ready_at() const;

  private:
    std::uint64_t rate_;
    std::int64_t burst_ns_;
    bool started_ = false;
    // The debt is paid at this time: whole nanoseconds, and parts of one in units of 1 / rate ns.
    std::int64_t paid_ns_ = 0;
    std::uint64_t paid_part_ = 0;
    std::int64_t latest_ns_ = 0;
};

}  // namespace ellicast::common
