#pragma once

#include <cstdint>

namespace ellicast::receiver {

/// How the losses of one or several streams lie, in datagrams. Two views of the same: runs of
/// losses one after another, and the bursts and gaps of RFC 3611 section 4.7.2 with Gmin = 16.
/// There a burst is a longest stretch that begins and ends with a loss, has at least two, and no
/// kGmin received ones in a row; all else is gap, isolated losses too.
struct LossPattern {
    static constexpr std::uint64_t kGmin = 16;

    std::uint64_t runs = 0;
    std::uint64_t longest_run = 0;
    std::uint64_t bursts = 0;
    std::uint64_t burst_lost = 0;
    std::uint64_t burst_received = 0;
    std::uint64_t gaps =
        0;  // stretches between bursts, and before and after them, that are not empty
    std::uint64_t gap_lost = 0;
    std::uint64_t gap_received = 0;

    [[nodiscard]] std::uint64_t lost() const { return burst_lost + gap_lost; }
    /// Losses in a row, on average; 0 without any.
    [[nodiscard]] double mean_run() const;
    /// Shares lost within bursts and within gaps; 0 where there are none.
    [[nodiscard]] double burst_density() const;
    [[nodiscard]] double gap_density() const;
    /// Datagrams from the first to the last loss; 0 without bursts, gaps.
    [[nodiscard]] double mean_burst() const;
    [[nodiscard]] double mean_gap() const;

    LossPattern& operator+=(const LossPattern& other);
    bool operator==(const LossPattern&) const = default;
};

/// Takes the fates of datagrams in the order of their numbers. Pure, constant time for each call.
class LossRuns {
  public:
    void add_received() {
        end_run();
        ++since_loss_;
    }
    /// That many lost in a row.
    void add_lost(std::uint64_t count = 1);

    /// As if the stream ended here.
    [[nodiscard]] LossPattern pattern() const;

  private:
    void end_run();
    void end_cluster();

    LossPattern pattern_;  // of what is over
    std::uint64_t run_ = 0;
    std::uint64_t since_loss_ = 0;  // received
    // Losses with fewer than kGmin received between neighbours: a burst when they are several.
    std::uint64_t cluster_lost_ = 0;
    std::uint64_t cluster_received_ = 0;
    std::uint64_t gap_length_ = 0;  // of the gap before the cluster, since the last burst
};

}  // namespace ellicast::receiver
