// receiver/round_progress.hpp
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/datagram.hpp"
#include "receiver/arrival.hpp"

namespace ellicast::receiver {

/// What the headers of one sender's datagrams say of its rounds: where we joined, and when which
/// end was reached. Reordering does not fool it: an end counts from the first datagram that proves
/// it.
class RoundProgress {
  public:
    void on_header(Time now, const protocol::DatagramHeader& header);

    /// When the last datagram of the last round was first seen; empty while it was not, and in a
    /// carousel without end.
    [[nodiscard]] std::optional<Time> stream_end() const { return stream_end_; }

    /// When the first round that we were there for from its first datagram on was over: its last
    /// datagram, or any of a later round, was seen.
    [[nodiscard]] std::optional<Time> full_round_end() const { return full_round_end_; }

    /// How many rounds, counted from the sender's first, are known to be over.
    [[nodiscard]] std::uint64_t rounds_over() const { return rounds_over_; }
    /// The highest round heard.
    [[nodiscard]] std::uint32_t round() const { return round_; }

  private:
    bool joined_ = false;
    std::uint64_t full_round_ = 0;  // the first round received from its start
    std::uint64_t rounds_over_ = 0;
    std::uint32_t round_ = 0;
    std::optional<Time> stream_end_;
    std::optional<Time> full_round_end_;
};

}  // namespace ellicast::receiver
