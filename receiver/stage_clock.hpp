// receiver/stage_clock.hpp
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace ellicast::receiver {

/// What one stage of a run took.
struct StageTime {
    std::string stage;
    double wall_s = 0;
    double cpu_s = 0;  // of all threads
};

/// Times named stages; one lasts until the next begins. A stage that comes again adds to its first
/// time.
class StageClock {
  public:
    void begin(const std::string& stage);
    void end();

    /// Ended stages in order of first appearance.
    [[nodiscard]] const std::vector<StageTime>& times() const { return times_; }

  private:
    std::string stage_;  // "" when none runs
    std::chrono::steady_clock::time_point wall_;
    double cpu_ = 0;
    std::vector<StageTime> times_;
};

}  // namespace ellicast::receiver
