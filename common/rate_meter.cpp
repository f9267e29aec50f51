// common/rate_meter.cpp
#include "common/rate_meter.hpp"

namespace ellicast::common {
namespace {

constexpr std::chrono::seconds kRecent(5);

}  // namespace

void RateMeter::add(std::chrono::nanoseconds now, std::uint64_t bits_in_all) {
    seen_.emplace_back(now, bits_in_all);
    while (seen_.size() > 2 && seen_[1].first <= now - kRecent) seen_.pop_front();
}

double RateMeter::bits_per_second() const {
    if (seen_.size() < 2) return 0.0;
    const auto& [begin, before] = seen_.front();
    const auto& [end, after] = seen_.back();
    if (!(end > begin) || !(after > before)) return 0.0;
    return static_cast<double>(after - before) / std::chrono::duration<double>(end - begin).count();
}

}  // namespace ellicast::common
