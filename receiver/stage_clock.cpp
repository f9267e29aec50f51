// receiver/stage_clock.cpp
#include "receiver/stage_clock.hpp"

#include <time.h>

#include <algorithm>

namespace ellicast::receiver {
namespace {

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

void StageClock::begin(const std::string& stage) {
    end();
    stage_ = stage;
    wall_ = std::chrono::steady_clock::now();
    cpu_ = cpu_seconds();
}

void StageClock::end() {
    if (stage_.empty()) return;
    auto time = std::find_if(times_.begin(), times_.end(),
                             [&](const StageTime& t) { return t.stage == stage_; });
    if (time == times_.end()) time = times_.insert(times_.end(), StageTime{stage_, 0, 0});
    const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - wall_;
    time->wall_s += lasted.count();
    time->cpu_s += cpu_seconds() - cpu_;
    stage_.clear();
}

}  // namespace ellicast::receiver
