#include "sender/rate_watch.hpp"

namespace ellicast::sender {
namespace {

double seconds(Time time) {
    return std::chrono::duration<double>(time).count();
}

double bits(std::uint64_t bytes) {
    return 8.0 * static_cast<double>(bytes);
}

}  // namespace

RateWatch::RateWatch(std::uint64_t bits_per_second, std::size_t datagram_bytes)
    : bits_per_second_(static_cast<double>(bits_per_second)), slack_bits_(bits(datagram_bytes)) {}

void RateWatch::begin(Time now, std::uint64_t bytes) {
    window_ = slow_ = {now, bytes};
    slow_windows_ = 0;
}

bool RateWatch::kept(Time now, std::uint64_t bytes) const {
    const double due = kShare * bits_per_second_ * seconds(now - window_.at);
    return bits(bytes - window_.bytes) + slack_bits_ >= due;
}

bool RateWatch::look(Time now, std::uint64_t bytes) {
    if (achieved_ || bits_per_second_ == 0.0) return !achieved_;
    const bool asleep = !last_look_ || now - *last_look_ > kAsleep;
    last_look_ = now;
    if (asleep) {
        begin(now, bytes);
        return true;
    }
    if (now - window_.at < kWindow) return true;
    if (kept(now, bytes)) {
        begin(now, bytes);
        return true;
    }
    window_ = {now, bytes};
    if (++slow_windows_ < kWindows) return true;
    achieved_ = bits(bytes - slow_.bytes) / seconds(now - slow_.at);
    return false;
}

}  // namespace ellicast::sender
