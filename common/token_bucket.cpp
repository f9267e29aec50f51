// common/token_bucket.cpp
#include "common/token_bucket.hpp"

#include <algorithm>
#include <cassert>

namespace ellicast::common {
namespace {

constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::uint64_t kLargestRate = 1'000'000'000'000;
constexpr std::size_t kLargestBytes = std::size_t{1} << 20;

}  // namespace

TokenBucket::TokenBucket(std::uint64_t bits_per_second, Time burst)
    : rate_(bits_per_second), burst_ns_(burst.count()) {
    assert(bits_per_second >= 1 && bits_per_second <= kLargestRate);
    assert(burst.count() >= 0 && burst <= std::chrono::seconds(1));
}

bool TokenBucket::take(Time now, std::size_t bytes) {
    assert(bytes <= kLargestBytes);
    latest_ns_ = started_ ? std::max(latest_ns_, now.count()) : now.count();
    if (!started_) paid_ns_ = latest_ns_;
    started_ = true;
    if (ready_at().count() > latest_ns_) return false;
    // Credit older than the burst is void.
    if (paid_ns_ < latest_ns_ - burst_ns_) {
        paid_ns_ = latest_ns_ - burst_ns_;
        paid_part_ = 0;
    }
    // bits / rate seconds = (8 bytes 10^9) / rate ns; below 2^23 * 2^30 the product fits.
    const std::uint64_t cost = 8 * bytes * kNanosecondsPerSecond + paid_part_;
    paid_ns_ += static_cast<std::int64_t>(cost / rate_);
    paid_part_ = cost % rate_;
    return true;
}

TokenBucket::Time TokenBucket::ready_at() const {
    if (!started_) return Time::min();
    return Time(paid_ns_ + (paid_part_ > 0 ? 1 : 0));
}

}  // namespace ellicast::common
