// sender/session.hpp
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/loss_model.hpp"
#include "common/token_bucket.hpp"
#include "sender/round_plan.hpp"

namespace ellicast::sender {

using Time = std::chrono::nanoseconds;  // since any epoch; the endpoint's clock says which
using Datagram = std::vector<std::uint8_t>;

struct SessionOptions {
    std::uint64_t bits_per_second = 20'000'000;  // UDP payload and ip_udp_bytes; 0: unpaced
    std::size_t ip_udp_bytes = 28;  // headers below the payload: 28 on IPv4, 48 on IPv6
    std::uint32_t ssrc = 0;
    std::uint16_t first_sequence = 0;
    std::uint32_t first_timestamp = 0;
    common::ImpairmentOptions impairment;
};

struct SessionCounts {
    std::uint64_t offered = 0;     // datagrams of the rounds, numbered and paid for
    std::uint64_t dropped = 0;     // of those, by the simulated loss
    std::uint64_t duplicated = 0;  // by the simulation: further datagrams
    std::uint32_t rounds = 0;      // whole ones offered
};

/// The sending end without sockets, clock and geometry: moments in, datagrams and counts out. In
/// each round the objects are sent one after another as one RTP stream, paced to the rate;
/// simulated loss acts after numbering and pacing, so that a receiver sees honest gaps and the pace
/// is that of a real loss. Pure and single-threaded: same plans, options and moments, same bytes. A
/// datagram's bytes depend on the moment only through its RTP timestamp.
class Session {
  public:
    /// Datagrams of one poll, at most, before simulated duplicates.
    static constexpr std::size_t kBatch = 64;

    /// Requires at least one plan, all with the same number of rounds (asserted).
    Session(std::vector<RoundPlan> plans, const SessionOptions& options);

    /// Appends the datagrams that are due, in order; at most kBatch of them, more are due when
    /// next_wakeup() has passed already. Moments that run backwards give nothing.
    void poll(Time now, std::vector<Datagram>& out);

    /// When the next datagram is due, perhaps in the past. Time::min() before the first poll and
    /// when unpaced. Meaningless once done.
    [[nodiscard]] Time next_wakeup() const;

    /// True when every round was sent and nothing is held back.
    [[nodiscard]] bool done() const { return done_; }

    [[nodiscard]] const std::vector<RoundPlan>& plans() const { return plans_; }
    [[nodiscard]] const SessionCounts& counts() const { return counts_; }
    /// Datagrams in all rounds; empty when they go on forever.
    [[nodiscard]] std::optional<std::uint64_t> datagrams_in_all() const;

  private:
    void offer(Datagram datagram, std::vector<Datagram>& out);
    void advance();

    std::vector<RoundPlan> plans_;
    SessionOptions options_;
    std::optional<common::TokenBucket> bucket_;  // absent when unpaced
    common::Impairment impairment_;
    common::LossSequence lost_ellipsoids_;
    common::LossSequence lost_vertices_;

    std::optional<Time> start_;
    std::uint16_t sequence_;
    std::uint32_t round_ = 0;
    std::size_t plan_ = 0;       // whose turn it is in the round
    std::uint32_t ordinal_ = 0;  // of the next datagram
    bool done_ = false;
    std::uint64_t left_empty_ = 0;  // datagrams that lost all their sections
    SessionCounts counts_;
};

}  // namespace ellicast::sender
