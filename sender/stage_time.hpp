// sender/stage_time.hpp
#pragma once

#include <chrono>
#include <ctime>
#include <string>
#include <vector>

namespace ellicast::sender {

/// What one stage took; CPU over all threads of the program.
struct StageTime {
    std::string stage;
    double wall_s = 0;
    double cpu_s = 0;
};

/// Of the whole program so far.
inline double cpu_seconds() {
    std::timespec time{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Runs a stage and notes what it took.
template <class Work>
auto timed(std::vector<StageTime>& stages, const char* stage, const Work& work) {
    const auto wall = std::chrono::steady_clock::now();
    const double cpu = cpu_seconds();
    auto result = work();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - wall;
    stages.push_back({stage, took.count(), cpu_seconds() - cpu});
    return result;
}

}  // namespace ellicast::sender
