// receiver/stream_statistics.cpp
#include "receiver/stream_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "receiver/eviction.hpp"

namespace ellicast::receiver {
namespace {

// A longer step than this, in datagrams, is no blackout that one would wait out (16 s at a million
// a second) but a lie; it is taken modulo 2^16 then.
constexpr std::int64_t kMaxStep = 1 << 24;

// Datagrams from (round a, ordinal i, of n) to (round b >= a, ordinal j, of m); the rounds between
// count as the later one. Empty when absurdly far.
std::optional<std::int64_t> steps_forward(std::uint32_t a, std::uint32_t i, std::uint32_t n,
                                          std::uint32_t b, std::uint32_t j, std::uint32_t m) {
    if (a == b) return std::int64_t{j} - std::int64_t{i};
    const std::int64_t between = std::int64_t{b} - std::int64_t{a} - 1;
    if (between > kMaxStep / std::int64_t{m}) return std::nullopt;
    return std::int64_t{n} - std::int64_t{i} + between * std::int64_t{m} + std::int64_t{j};
}

// Places in a ring of 64-bit words, of negative numbers too.
std::uint64_t bit_of(std::int64_t sequence) {
    return std::uint64_t{1} << (static_cast<std::uint64_t>(sequence) % 64);
}

double to_seconds(Time time) {
    return std::chrono::duration<double>(time).count();
}

}  // namespace

StreamCounts& StreamCounts::operator+=(const StreamCounts& other) {
    received += other.received;
    lost += other.lost;
    duplicate += other.duplicate;
    reordered += other.reordered;
    bytes += other.bytes;
    reorder_farthest = std::max(reorder_farthest, other.reorder_farthest);
    reorder_sum += other.reorder_sum;
    recent_lost += other.recent_lost;
    recent_expected += other.recent_expected;
    pattern += other.pattern;
    if (other.datagram_ms > 0) datagram_ms = other.datagram_ms;
    jitter_ms = std::max(jitter_ms, other.jitter_ms);
    return *this;
}

StreamStatistics::StreamStatistics(Time listening_since)
    : listening_since_(listening_since), seen_(kWindow / 64, 0) {}

void StreamStatistics::on_datagram(Time now, const protocol::DatagramHeader& header,
                                   std::size_t bytes) {
    const Place place{.sequence = counts_.received == 0 ? header.rtp.sequence : extend(header),
                      .round = header.round,
                      .rounds = header.rounds,
                      .ordinal = header.ordinal,
                      .datagrams = header.datagrams,
                      .object = header.object};
    if (counts_.received == 0) start(now, place);
    ++counts_.received;
    counts_.bytes += bytes;
    last_seen_ = now;

    const bool late = place.sequence <= newest_.sequence && distinct_ > 0;
    if (place.sequence > newest_.sequence) settle(place.sequence);
    if (!mark(place.sequence)) {
        ++counts_.duplicate;
        return;
    }
    if (late) {
        const auto behind = static_cast<std::uint64_t>(newest_.sequence - place.sequence);
        ++counts_.reordered;
        counts_.reorder_sum += behind;
        counts_.reorder_farthest = std::max(counts_.reorder_farthest, behind);
    }
    if (distinct_++ > 0) update_jitter(now, header.rtp.timestamp);
    previous_arrival_ = now;
    previous_timestamp_ = header.rtp.timestamp;
    if (place.sequence < oldest_.sequence) {
        if (settled_ == oldest_.sequence) settled_ = place.sequence;  // nothing was settled yet
        oldest_ = place;
    }
    if (place.sequence > newest_.sequence) {
        newest_ = place;
        newest_seen_ = now;
    }
}

std::size_t StreamStatistics::word_of(std::int64_t sequence) {
    return static_cast<std::uint64_t>(sequence) / 64 % (kWindow / 64);
}

void StreamStatistics::start(Time now, const Place& place) {
    first_seen_ = newest_seen_ = now;
    oldest_ = newest_ = place;
    settled_ = place.sequence;
}

bool StreamStatistics::was_seen(std::int64_t sequence) const {
    return (seen_[word_of(sequence)] & bit_of(sequence)) != 0;
}

void StreamStatistics::settle_until(std::int64_t end, std::int64_t& settled, LossRuns& runs,
                                    const StreamStatistics& of) {
    for (; settled < end; ++settled) {
        if (of.was_seen(settled)) {
            runs.add_received();
        } else {
            runs.add_lost();
        }
    }
}

// Before `newest` makes the window forget: what lies kSettling behind it has its fate. Numbers that
// were jumped over are lost without a look.
void StreamStatistics::settle(std::int64_t newest) {
    const std::int64_t end = newest - kSettling;
    settle_until(std::min(end, newest_.sequence + 1), settled_, runs_, *this);
    if (settled_ < end) {
        runs_.add_lost(static_cast<std::uint64_t>(end - settled_));
        settled_ = end;
    }
}

void StreamStatistics::add_pattern(StreamCounts& counts) const {
    LossRuns runs = runs_;
    std::int64_t settled = settled_;
    settle_until(newest_.sequence + 1, settled, runs, *this);
    counts.pattern = runs.pattern();
    const std::int64_t begin = std::max(oldest_.sequence, newest_.sequence - kRecent + 1);
    for (std::int64_t s = begin; s <= newest_.sequence; ++s) counts.recent_lost += !was_seen(s);
    counts.recent_expected = static_cast<std::uint64_t>(newest_.sequence - begin + 1);
    const std::int64_t steps = newest_.sequence - oldest_.sequence;
    if (steps > 0) {
        counts.datagram_ms =
            1000.0 * to_seconds(newest_seen_ - first_seen_) / static_cast<double>(steps);
    }
}

std::int64_t StreamStatistics::extend(const protocol::DatagramHeader& header) const {
    const auto step16 = static_cast<std::uint16_t>(header.rtp.sequence -
                                                   static_cast<std::uint16_t>(newest_.sequence));
    std::int64_t step = static_cast<std::int16_t>(step16);
    if (header.object == newest_.object) {
        const bool forward = header.round >= newest_.round;
        std::optional<std::int64_t> steps =
            forward ? steps_forward(newest_.round, newest_.ordinal, newest_.datagrams, header.round,
                                    header.ordinal, header.datagrams)
                    : steps_forward(header.round, header.ordinal, header.datagrams, newest_.round,
                                    newest_.ordinal, newest_.datagrams);
        if (steps && !forward) steps = -*steps;
        if (steps && std::abs(*steps) <= kMaxStep && static_cast<std::uint16_t>(*steps) == step16) {
            step = *steps;
        }
    }
    return newest_.sequence + step;
}

// False when the sequence number was seen before, or is too old to tell.
bool StreamStatistics::mark(std::int64_t sequence) {
    const std::int64_t newest = newest_.sequence;
    if (newest - sequence >= kWindow) return false;
    if (sequence - newest >= kWindow) {
        seen_.assign(seen_.size(), 0);
    } else {
        // Forget what is kWindow behind; whole words at once, so that lies about gaps cost little.
        for (std::int64_t s = newest + 1; s <= sequence;) {
            const bool whole = s % 64 == 0 && s + 64 <= sequence + 1;
            seen_[word_of(s)] &= whole ? 0 : ~bit_of(s);
            s += whole ? 64 : 1;
        }
    }
    std::uint64_t& word = seen_[word_of(sequence)];
    if ((word & bit_of(sequence)) != 0) return false;
    word |= bit_of(sequence);
    return true;
}

// RFC 3550 A.8: J += (|D| - J) / 16, D = difference of the relative transit times. Copies do not
// count.
void StreamStatistics::update_jitter(Time now, std::uint32_t timestamp) {
    const double arrival = to_seconds(now - previous_arrival_) * protocol::kRtpClockHz;
    const auto sent = static_cast<std::int32_t>(timestamp - previous_timestamp_);
    jitter_ += (std::abs(arrival - sent) - jitter_) / 16.0;
}

std::uint64_t StreamStatistics::lost_head() const {
    const std::uint64_t announced =
        std::uint64_t{oldest_.round} * oldest_.datagrams + oldest_.ordinal;
    const double listened = std::max(0.0, to_seconds(first_seen_ - listening_since_));
    const double lasted = to_seconds(newest_seen_ - first_seen_);
    if (!(lasted > 0.0)) return announced;  // no pace to go by
    // A quarter of a step of slack, so that a sender who starts with us is counted exactly.
    const double sent =
        listened / lasted * static_cast<double>(newest_.sequence - oldest_.sequence) + 0.25;
    return sent < static_cast<double>(announced) ? static_cast<std::uint64_t>(sent) : announced;
}

std::uint64_t StreamStatistics::lost_tail() const {
    const bool last_round = newest_.rounds != 0 && newest_.round + 1 == newest_.rounds;
    return last_round ? newest_.datagrams - 1 - newest_.ordinal : 0;
}

StreamCounts StreamStatistics::counts(bool ended) const {
    StreamCounts counts = counts_;
    if (counts.received == 0) return counts;
    const auto span = static_cast<std::uint64_t>(newest_.sequence - oldest_.sequence) + 1;
    counts.lost = span - std::min(span, distinct_) + lost_head() + (ended ? lost_tail() : 0);
    counts.jitter_ms = jitter_ * 1000.0 / protocol::kRtpClockHz;
    add_pattern(counts);
    return counts;
}

StreamTable::StreamTable(Time listening_since, std::size_t limit)
    : listening_since_(listening_since), limit_(std::max<std::size_t>(limit, 1)) {}

void StreamTable::on_datagram(Time now, const SenderKey& sender,
                              const protocol::DatagramHeader& header, std::size_t bytes) {
    const StreamKey key{sender, header.rtp.ssrc};
    if (latest_ >= streams_.size() || streams_[latest_].key != key) {
        latest_ = static_cast<std::size_t>(
            std::find_if(streams_.begin(), streams_.end(),
                         [&](const Entry& entry) { return entry.key == key; }) -
            streams_.begin());
    }
    if (latest_ == streams_.size()) {
        if (streams_.size() >= limit_) {
            const std::size_t victim = entry_to_evict(
                streams_, [](const Entry& e) { return e.statistics.received(); },
                [](const Entry& e) { return e.statistics.last_seen(); });
            streams_.erase(streams_.begin() + static_cast<std::ptrdiff_t>(victim));
        }
        streams_.push_back({key, StreamStatistics(listening_since_)});
        latest_ = streams_.size() - 1;
    }
    streams_[latest_].statistics.on_datagram(now, header, bytes);
}

StreamCounts StreamTable::counts(const std::vector<SenderKey>& senders, bool ended) const {
    StreamCounts sum;
    for (const Entry& entry : streams_) {
        if (std::find(senders.begin(), senders.end(), entry.key.sender) != senders.end()) {
            sum += entry.statistics.counts(ended);
        }
    }
    return sum;
}

std::uint64_t MalformedCounts::total() const {
    return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

}  // namespace ellicast::receiver
