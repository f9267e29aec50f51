// receiver/stream_statistics.hpp
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/datagram.hpp"
#include "receiver/arrival.hpp"
#include "receiver/loss_runs.hpp"
#include "receiver/record_store.hpp"

namespace ellicast::receiver {

/// What became of the datagrams of one or several streams. received - duplicate + lost is what the
/// sender sent while we listened, as far as its numbering tells.
struct StreamCounts {
    std::uint64_t received = 0;   // valid datagrams, copies too
    std::uint64_t lost = 0;       // numbered, never seen
    std::uint64_t duplicate = 0;  // seen before
    std::uint64_t reordered = 0;  // came after one that was sent later
    std::uint64_t bytes = 0;      // UDP payload of the received
    double jitter_ms = 0;         // RFC 3550 section 6.4.1; of several streams, the largest
    // How far behind the newest the reordered came, in datagrams (RFC 4737's extent): the farthest,
    // and the sum.
    std::uint64_t reorder_farthest = 0;
    std::uint64_t reorder_sum = 0;
    // Among the last kRecent numbers, or as many as there were.
    std::uint64_t recent_lost = 0;
    std::uint64_t recent_expected = 0;
    // From the first number heard to the last. Who comes later than kSettling numbers is lost here.
    LossPattern pattern;
    double datagram_ms = 0;  // mean time from number to number; of several streams, the latest's

    StreamCounts& operator+=(const StreamCounts& other);
};

/// Counts one RTP stream. Sequence numbers are extended to 64 bits: a step of up to 32767 either
/// way is taken from the 16 bits alone, a longer one (a blackout) from rounds and ordinals where
/// they agree with the 16 bits. 4 kB, constant time per datagram. Pure.
class StreamStatistics {
  public:
    /// `listening_since` tells a lost beginning from a late join.
    explicit StreamStatistics(Time listening_since);

    void on_datagram(Time now, const protocol::DatagramHeader& header, std::size_t bytes);

    /// `ended`: nothing more is to come, so what the last round still announces counts as lost.
    /// What the rounds announced before the first datagram counts as far as it was sent while we
    /// listened, going by the stream's mean pace.
    [[nodiscard]] StreamCounts counts(bool ended) const;

    static constexpr std::int64_t kRecent = 1024;
    static constexpr std::int64_t kSettling = 512;

    [[nodiscard]] Time last_seen() const { return last_seen_; }
    [[nodiscard]] std::uint64_t received() const { return counts_.received; }

  private:
    // Copies and late datagrams are told apart this far behind the newest.
    static constexpr std::int64_t kWindow = 32'768;

    // What places a datagram in the sender's numbering.
    struct Place {
        std::int64_t sequence = 0;  // extended
        std::uint32_t round = 0;
        std::uint32_t rounds = 0;
        std::uint32_t ordinal = 0;
        std::uint32_t datagrams = 1;
        protocol::ObjectId object{};
    };
    [[nodiscard]] std::int64_t extend(const protocol::DatagramHeader& header) const;
    [[nodiscard]] std::uint64_t lost_head() const;
    [[nodiscard]] std::uint64_t lost_tail() const;
    void start(Time now, const Place& place);
    static std::size_t word_of(std::int64_t sequence);
    [[nodiscard]] bool was_seen(std::int64_t sequence) const;
    void settle(std::int64_t newest);
    static void settle_until(std::int64_t end, std::int64_t& settled, LossRuns& runs,
                             const StreamStatistics& of);
    void add_pattern(StreamCounts& counts) const;
    bool mark(std::int64_t sequence);
    void update_jitter(Time now, std::uint32_t timestamp);

    Time listening_since_;
    Time first_seen_{};
    Time newest_seen_{};  // arrival of `newest_`
    Time last_seen_{};
    Time previous_arrival_{};
    std::uint32_t previous_timestamp_ = 0;
    double jitter_ = 0;  // 90 kHz units
    Place oldest_;       // lowest sequence number so far
    Place newest_;       // highest
    std::uint64_t distinct_ = 0;
    StreamCounts counts_;
    std::int64_t settled_ = 0;  // numbers below are in runs_
    LossRuns runs_;
    std::vector<std::uint64_t> seen_;  // ring of bits over the last kWindow sequence numbers
};

/// One stream of one sender instance.
struct StreamKey {
    SenderKey sender;
    std::uint32_t ssrc = 0;
    auto operator<=>(const StreamKey&) const = default;
};

/// Statistics of all streams, bounded in number; a lesser stream goes for a new one
/// (entry_to_evict).
class StreamTable {
  public:
    explicit StreamTable(Time listening_since, std::size_t limit = 64);

    void on_datagram(Time now, const SenderKey& sender, const protocol::DatagramHeader& header,
                     std::size_t bytes);

    /// Sum over the streams of the senders given.
    [[nodiscard]] StreamCounts counts(const std::vector<SenderKey>& senders, bool ended) const;

  private:
    struct Entry {
        StreamKey key;
        StreamStatistics statistics;
    };
    Time listening_since_;
    std::size_t limit_;
    std::vector<Entry> streams_;
    std::size_t latest_ = 0;
};

/// Why datagrams were dropped, by WireError.
class MalformedCounts {
  public:
    void add(protocol::WireError cause) { ++counts_[static_cast<std::size_t>(cause)]; }
    [[nodiscard]] std::uint64_t of(protocol::WireError cause) const {
        return counts_[static_cast<std::size_t>(cause)];
    }
    [[nodiscard]] std::uint64_t total() const;

  private:
    std::array<std::uint64_t, static_cast<std::size_t>(protocol::WireError::kCount)> counts_{};
};

}  // namespace ellicast::receiver
