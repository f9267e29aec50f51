#include "receiver/loss_runs.hpp"

#include <algorithm>
#include <utility>

namespace ellicast::receiver {
namespace {

double ratio(std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

}  // namespace

double LossPattern::mean_run() const {
    return ratio(lost(), runs);
}
double LossPattern::burst_density() const {
    return ratio(burst_lost, burst_lost + burst_received);
}
double LossPattern::gap_density() const {
    return ratio(gap_lost, gap_lost + gap_received);
}
double LossPattern::mean_burst() const {
    return ratio(burst_lost + burst_received, bursts);
}
double LossPattern::mean_gap() const {
    return ratio(gap_lost + gap_received, gaps);
}

LossPattern& LossPattern::operator+=(const LossPattern& other) {
    runs += other.runs;
    longest_run = std::max(longest_run, other.longest_run);
    bursts += other.bursts;
    burst_lost += other.burst_lost;
    burst_received += other.burst_received;
    gaps += other.gaps;
    gap_lost += other.gap_lost;
    gap_received += other.gap_received;
    return *this;
}

void LossRuns::end_run() {
    if (run_ == 0) return;
    ++pattern_.runs;
    pattern_.longest_run = std::max(pattern_.longest_run, run_);
    run_ = 0;
}

/// What follows the cluster's last loss is not its own.
void LossRuns::end_cluster() {
    if (cluster_lost_ == 1) {
        ++pattern_.gap_lost;
        ++gap_length_;
    } else if (cluster_lost_ > 1) {
        if (gap_length_ > 0) ++pattern_.gaps;
        gap_length_ = 0;
        ++pattern_.bursts;
        pattern_.burst_lost += cluster_lost_;
        pattern_.burst_received += cluster_received_;
    }
    cluster_lost_ = cluster_received_ = 0;
}

void LossRuns::add_lost(std::uint64_t count) {
    if (count == 0) return;
    const std::uint64_t between = std::exchange(since_loss_, 0);
    if (cluster_lost_ > 0 && between < LossPattern::kGmin) {
        cluster_received_ += between;
    } else {
        end_cluster();
        pattern_.gap_received += between;
        gap_length_ += between;
    }
    cluster_lost_ += count;
    run_ += count;
}

LossPattern LossRuns::pattern() const {
    LossRuns ended = *this;
    ended.end_run();
    ended.end_cluster();
    ended.pattern_.gap_received += since_loss_;
    ended.gap_length_ += since_loss_;
    if (ended.gap_length_ > 0) ++ended.pattern_.gaps;
    return ended.pattern_;
}

}  // namespace ellicast::receiver
