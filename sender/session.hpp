// sender/session.hpp
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/loss_model.hpp"
#include "common/token_bucket.hpp"
#include "sender/datagram_security.hpp"
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
    std::uint64_t paid_bytes = 0;  // for those, headers included: what the rate is about
    std::uint64_t dropped = 0;     // of those, by the simulated loss
    std::uint64_t duplicated = 0;  // by the simulation: further datagrams
    std::uint32_t rounds = 0;      // whole ones offered
};

/// The sending end without sockets, clock and geometry: moments in, datagrams and counts out. In
/// each round the objects are sent one after another as one RTP stream, paced to the rate;
/// simulated loss acts after numbering and pacing, so that a receiver sees honest gaps and the pace
/// is that of a real loss. Pure and single-threaded: same plans, options and moments, same bytes. A
/// datagram's bytes depend on the moment only through its RTP timestamp and sending time.
class Session {
  public:
    /// Datagrams of one poll, at most, before simulated duplicates.
    static constexpr std::size_t kBatch = 64;

    /// Requires at least one plan, all with the same number of rounds (asserted). The plan at index
    /// k is page k of the carousel. With `security` every datagram is sealed and signed after it
    /// was numbered and before simulated loss of whole datagrams; plans must have left room for it.
    Session(std::vector<RoundPlan> plans, const SessionOptions& options,
            std::optional<DatagramSecurity> security = std::nullopt);

    /// Gives a page, that is the plan at this index, a new object. It is sent from the page's next
    /// turn on: until then, and for as long as its present turn lasts, the old one stays on air. Of
    /// several waiting for one turn the last remains. Plans that are paged tell the contents.
    /// Requires page < plans().size(), and rounds as the others have (asserted).
    void replace(std::size_t page, RoundPlan plan);

    /// Ends with the present round, where it was not the last anyway.
    void finish_round() { finishing_ = true; }
    [[nodiscard]] bool finishing() const { return finishing_; }

    /// Appends the datagrams that are due, in order; at most kBatch of them, more are due when
    /// next_wakeup() has passed already. Moments that run backwards give nothing.
    void poll(Time now, std::vector<Datagram>& out);

    /// Takes datagrams that are done with, for later ones to be made in their memory; keeps that of
    /// some hundreds and leaves the vector empty.
    void recycle(std::vector<Datagram>& spent);

    /// When the next datagram is due, perhaps in the past. Time::min() before the first poll and
    /// when unpaced. Meaningless once done.
    [[nodiscard]] Time next_wakeup() const;

    /// Whatever is left is due at once.
    [[nodiscard]] bool unpaced() const { return !bucket_; }

    /// True when every round was sent and nothing is held back.
    [[nodiscard]] bool done() const { return done_; }

    /// True when finish_round() left out rounds that should have been sent.
    [[nodiscard]] bool cut_short() const;

    /// Those on air, by page.
    [[nodiscard]] const std::vector<RoundPlan>& plans() const { return plans_; }
    /// Of each page: 1, and one more for each replacement on air.
    [[nodiscard]] const std::vector<std::uint32_t>& versions() const { return versions_; }
    /// The round in which a page's version was new.
    [[nodiscard]] std::uint32_t first_round(std::size_t page) const { return first_rounds_[page]; }
    /// Whose turn it is, the round's number and the next datagram's in it.
    [[nodiscard]] std::size_t page() const { return plan_; }
    [[nodiscard]] std::uint32_t round() const { return round_; }
    [[nodiscard]] std::uint32_t ordinal() const { return ordinal_; }
    /// Plans that were replaced: large, and best given up where nobody waits.
    [[nodiscard]] std::vector<RoundPlan> take_retired();
    [[nodiscard]] const SessionCounts& counts() const { return counts_; }
    /// Datagrams in all rounds; empty when they go on forever.
    [[nodiscard]] std::optional<std::uint64_t> datagrams_in_all() const;

  private:
    void offer(Time now, Datagram datagram, std::vector<Datagram>& out);
    void advance();
    Datagram take_spent();
    void begin_turn();
    void tell_contents();

    std::vector<RoundPlan> plans_;
    std::vector<std::uint32_t> versions_;
    std::vector<std::uint32_t> first_rounds_;   // of the versions on air
    std::map<std::size_t, RoundPlan> waiting_;  // by page, for its next turn
    std::vector<RoundPlan> retired_;
    SessionOptions options_;
    std::optional<common::TokenBucket> bucket_;  // absent when unpaced
    std::optional<DatagramSecurity> security_;   // absent when in clear
    std::size_t security_bytes_ = 0;
    common::Impairment impairment_;
    common::LossSequence lost_ellipsoids_;
    common::LossSequence lost_vertices_;

    std::optional<Time> start_;
    std::uint16_t sequence_;
    std::uint32_t round_ = 0;
    std::size_t plan_ = 0;         // whose turn it is in the round
    std::uint32_t ordinal_ = 0;    // of the next datagram
    std::vector<Datagram> spent_;  // memory for later datagrams
    bool finishing_ = false;
    bool done_ = false;
    std::uint64_t left_empty_ = 0;  // datagrams that lost all their sections
    SessionCounts counts_;
};

}  // namespace ellicast::sender
