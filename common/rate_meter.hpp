// common/rate_meter.hpp
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <utility>

namespace ellicast::common {

/// The rate over the last five seconds, from a count that grows. Pure.
class RateMeter {
  public:
    /// Moments must not run backwards. A count that falls is another one: the rate is 0 until it is
    /// past what it was, or that is five seconds ago.
    void add(std::chrono::nanoseconds now, std::uint64_t bits_in_all);
    /// 0 before two moments are known.
    [[nodiscard]] double bits_per_second() const;

  private:
    std::deque<std::pair<std::chrono::nanoseconds, std::uint64_t>> seen_;  // and one before
};

}  // namespace ellicast::common
