// tests/receiver/stream_statistics_test.cpp
#include "receiver/stream_statistics.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <set>

#include "common/random.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;

namespace {

// Datagram n of a sender that numbers rounds of `per_round` datagrams, one each millisecond from 1
// s on.
protocol::DatagramHeader nth(std::uint64_t n, std::uint32_t per_round, std::uint32_t rounds = 0,
                             std::uint16_t first_sequence = 65'000) {
    protocol::DatagramHeader header;
    header.rtp.sequence = static_cast<std::uint16_t>(first_sequence + n);
    header.rtp.timestamp = static_cast<std::uint32_t>(4'294'900'000u + 90 * n);
    header.round = static_cast<std::uint32_t>(n / per_round);
    header.rounds = rounds;
    header.ordinal = static_cast<std::uint32_t>(n % per_round);
    header.datagrams = per_round;
    return header;
}

Time sent_at(std::uint64_t n) {
    return 1s + n * 1ms;
}

// Counted with a set and no arithmetic modulo anything.
struct Oracle {
    std::set<std::uint64_t> seen;
    StreamCounts counts;

    void on(std::uint64_t n, std::size_t bytes) {
        ++counts.received;
        counts.bytes += bytes;
        const bool late = !seen.empty() && n < *seen.rbegin();
        if (!seen.insert(n).second) {
            ++counts.duplicate;
        } else if (late) {
            ++counts.reordered;
            counts.reorder_sum += *seen.rbegin() - n;
            counts.reorder_farthest = std::max(counts.reorder_farthest, *seen.rbegin() - n);
        }
    }
    /// How the losses lie between the first and the last seen.
    [[nodiscard]] LossPattern pattern() const {
        LossRuns runs;
        for (std::uint64_t n = *seen.begin(); n <= *seen.rbegin(); ++n) {
            if (seen.count(n) > 0) {
                runs.add_received();
            } else {
                runs.add_lost();
            }
        }
        return runs.pattern();
    }
    [[nodiscard]] std::uint64_t recent_lost() const {
        std::uint64_t lost = 0;
        const std::uint64_t end = *seen.rbegin() + 1;
        const std::uint64_t begin =
            std::max(*seen.begin(), end - std::min<std::uint64_t>(end, 1024));
        for (std::uint64_t n = begin; n < end; ++n) lost += seen.count(n) == 0;
        return lost;
    }
};

}  // namespace

TEST_CASE("counts equal a brute-force oracle's through loss, copies, reordering and wrap-around") {
    const std::uint64_t seed = GENERATE(range(1u, 11u));
    CAPTURE(seed);
    common::Random random(seed);
    constexpr std::uint64_t kSent = 150'000;  // over two wrap-arounds
    const auto per_round = static_cast<std::uint32_t>(1 + random.below(3000));
    const double loss = random.uniform() * 0.9;

    std::vector<std::uint64_t> order;
    for (std::uint64_t n = 0; n < kSent; ++n) {
        if (random.chance(loss)) continue;
        order.push_back(n);
        if (random.chance(0.02)) order.push_back(n);
    }
    for (std::size_t k = 0; k + 40 < order.size(); ++k) {
        if (random.chance(0.03)) std::swap(order[k], order[k + 1 + random.below(39)]);
    }
    const std::uint32_t rounds = static_cast<std::uint32_t>((kSent + per_round - 1) / per_round);
    const std::uint64_t announced = std::uint64_t{rounds} * per_round;

    StreamStatistics statistics(0s);
    Oracle oracle;
    for (const std::uint64_t n : order) {
        statistics.on_datagram(sent_at(n), nth(n, per_round, rounds), 100);
        oracle.on(n, 100);
    }
    {
        const StreamCounts so_far = statistics.counts(false);
        CHECK(so_far.reorder_sum == oracle.counts.reorder_sum);
        CHECK(so_far.reorder_farthest == oracle.counts.reorder_farthest);
        CHECK(so_far.recent_lost == oracle.recent_lost());
        if (so_far.reorder_farthest < StreamStatistics::kSettling) {
            CHECK(so_far.pattern == oracle.pattern());
        } else {
            CHECK(so_far.pattern.lost() >= oracle.pattern().lost());
        }
    }
    const std::uint64_t tail =
        *oracle.seen.rbegin() / per_round + 1 == rounds ? announced - 1 - *oracle.seen.rbegin() : 0;
    const std::uint64_t lost_so_far = *oracle.seen.rbegin() + 1 - oracle.seen.size();

    CHECK(statistics.counts(false).received == oracle.counts.received);
    CHECK(statistics.counts(false).bytes == oracle.counts.bytes);
    CHECK(statistics.counts(false).duplicate == oracle.counts.duplicate);
    CHECK(statistics.counts(false).reordered == oracle.counts.reordered);
    CHECK(statistics.counts(false).lost == lost_so_far);
    CHECK(statistics.counts(true).lost == lost_so_far + tail);
}

TEST_CASE("what was received, less copies, plus lost, is what was sent") {
    StreamStatistics statistics(0s);
    for (const std::uint64_t n : {7u, 5u, 5u, 9u, 20u}) {
        statistics.on_datagram(sent_at(n), nth(n, 30, 1), 1);
    }
    const StreamCounts counts = statistics.counts(true);
    CHECK(counts.received - counts.duplicate + counts.lost == 30);
}

TEST_CASE("copies are told from late datagrams 32767 numbers back") {
    StreamStatistics statistics(0s);
    for (std::uint64_t n = 0; n <= 40'000; ++n) statistics.on_datagram(sent_at(n), nth(n, 500), 1);
    constexpr std::uint64_t kNewest = 40'100;
    statistics.on_datagram(sent_at(kNewest), nth(kNewest, 500), 1);
    const std::uint64_t lost = statistics.counts(false).lost;
    for (std::uint64_t back = 101; back < 32'768; ++back) {
        statistics.on_datagram(sent_at(kNewest), nth(kNewest - back, 500), 1);
    }
    CHECK(statistics.counts(false).duplicate == 32'768 - 101);
    CHECK(statistics.counts(false).lost == lost);
    for (std::uint64_t back = 1; back < 100; ++back) {
        statistics.on_datagram(sent_at(kNewest), nth(kNewest - back, 500), 1);
    }
    CHECK(statistics.counts(false).reordered == 99);
    CHECK(statistics.counts(false).lost == 0);
}

TEST_CASE("a blackout of more than half the sequence numbers is counted by ordinals") {
    for (const std::uint64_t gap : {40'000u, 65'536u, 70'000u, 500'000u}) {
        CAPTURE(gap);
        StreamStatistics statistics(0s);
        statistics.on_datagram(sent_at(0), nth(0, 1000), 1);
        statistics.on_datagram(sent_at(gap), nth(gap, 1000), 1);
        CHECK(statistics.counts(false).lost == gap - 1);
        // What was on its way before the blackout comes late, and is no loss.
        statistics.on_datagram(sent_at(gap), nth(gap - 1, 1000), 1);
        CHECK(statistics.counts(false).lost == gap - 2);
        CHECK(statistics.counts(false).reordered == 1);
    }
}

TEST_CASE("ordinals that contradict the sequence number are not believed") {
    StreamStatistics statistics(0s);
    statistics.on_datagram(sent_at(0), nth(0, 100), 1);
    protocol::DatagramHeader liar = nth(3, 100);
    liar.round = 4'000'000'000u;
    liar.datagrams = 4'000'000'000u;
    liar.ordinal = 3'999'999'999u;
    statistics.on_datagram(sent_at(3), liar, 1);
    CHECK(statistics.counts(false).lost == 2);
}

TEST_CASE("a lost beginning counts for who listened, and not for who came late") {
    const auto lost_with = [](Time listening_since, std::uint64_t first) {
        StreamStatistics statistics(listening_since);
        for (std::uint64_t n = first; n < first + 500; ++n) {
            statistics.on_datagram(sent_at(n), nth(n, 400), 1);
        }
        return statistics.counts(false).lost;
    };
    CHECK(lost_with(0s, 0) == 0);
    CHECK(lost_with(0s, 7) == 7);
    CHECK(lost_with(0s, 900) == 900);          // whole rounds of the beginning
    CHECK(lost_with(sent_at(150), 150) == 0);  // late, and at once there
    CHECK(lost_with(sent_at(2000) - 500us, 2000) == 0);
    CHECK(lost_with(sent_at(2000), 2040) == 40);  // late, and then 40 ms of loss
}

TEST_CASE("the end of the last round counts as lost only when nothing more is to come") {
    StreamStatistics statistics(0s);
    for (std::uint64_t n = 0; n < 190; ++n) statistics.on_datagram(sent_at(n), nth(n, 100, 2), 1);
    CHECK(statistics.counts(false).lost == 0);
    CHECK(statistics.counts(true).lost == 10);

    StreamStatistics carousel(0s);
    for (std::uint64_t n = 0; n < 190; ++n) carousel.on_datagram(sent_at(n), nth(n, 100, 0), 1);
    CHECK(carousel.counts(true).lost == 0);
}

TEST_CASE("jitter is that of RFC 3550 A.8") {
    common::Random random(3);
    StreamStatistics statistics(0s);
    double expected = 0;  // in 90 kHz units
    double transit = 0;
    for (std::uint64_t n = 0; n < 300; ++n) {
        const double delay = std::floor(random.uniform() * 5e6);  // ns
        statistics.on_datagram(sent_at(n) + Time(static_cast<std::int64_t>(delay)), nth(n, 500), 1);
        const double d = delay * 90'000 / 1e9 - transit;
        transit += d;
        if (n > 0) expected += (std::abs(d) - expected) / 16;
    }
    CHECK(statistics.counts(false).jitter_ms == Approx(expected / 90).epsilon(1e-9));
    CHECK(expected > 10);
}

TEST_CASE("an even stream has no jitter, whatever its timestamps wrap around") {
    StreamStatistics statistics(0s);
    for (std::uint64_t n = 0; n < 2000; ++n) statistics.on_datagram(sent_at(n), nth(n, 500), 1);
    CHECK(statistics.counts(false).jitter_ms == Approx(0).margin(1e-6));
}

TEST_CASE("streams are counted apart, and only those asked for are summed") {
    StreamTable table(0s);
    SenderKey a;
    SenderKey b;
    b.session[0] = 1;
    for (const std::uint64_t n : {0u, 2u}) table.on_datagram(sent_at(n), a, nth(n, 10), 5);
    for (const std::uint64_t n : {0u, 9u}) table.on_datagram(sent_at(n), b, nth(n, 10), 7);
    auto other_ssrc = nth(4, 10, 0, 1234);
    other_ssrc.rtp.ssrc = 99;
    table.on_datagram(sent_at(4), a, other_ssrc, 5);

    CHECK(table.counts({a}, false).received == 3);
    CHECK(table.counts({b}, false).lost == 8);
    CHECK(table.counts({a, b}, false).bytes == 3 * 5 + 2 * 7);
}

TEST_CASE("a flood of streams does not wash away the one that goes on") {
    StreamTable table(0s, 8);
    const SenderKey real;
    common::Random random(5);
    for (std::uint64_t n = 0; n < 1000; ++n) {
        table.on_datagram(sent_at(n), real, nth(n, 2000), 1);
        SenderKey stranger;
        stranger.session[1] = static_cast<std::uint8_t>(random.below(255) + 1);
        stranger.session[2] = static_cast<std::uint8_t>(random.below(256));
        table.on_datagram(sent_at(n), stranger, nth(n, 2000), 1);
    }
    CHECK(table.counts({real}, false).received == 1000);
}

TEST_CASE("malformed datagrams are counted by cause") {
    MalformedCounts counts;
    counts.add(protocol::WireError::bad_checksum);
    counts.add(protocol::WireError::bad_checksum);
    counts.add(protocol::WireError::too_short);
    CHECK(counts.total() == 3);
    CHECK(counts.of(protocol::WireError::bad_checksum) == 2);
    CHECK(counts.of(protocol::WireError::bad_hint) == 0);
}

TEST_CASE("a blackout longer than the window is one run") {
    StreamStatistics statistics(0s);
    constexpr std::uint64_t kBlackout = 100'000;  // over a wrap-around; the rounds tell how long
    std::uint64_t n = 0;
    for (; n < 2000; ++n) statistics.on_datagram(sent_at(n), nth(n, 500), 100);
    n += kBlackout;
    for (std::uint64_t k = 0; k < 2000; ++k, ++n) {
        statistics.on_datagram(sent_at(n), nth(n, 500), 100);
    }
    const StreamCounts counts = statistics.counts(false);
    CHECK(counts.lost == kBlackout);
    CHECK(counts.pattern.runs == 1);
    CHECK(counts.pattern.longest_run == kBlackout);
    CHECK(counts.pattern.bursts == 1);
    CHECK(counts.pattern.burst_density() == 1.0);
    CHECK(counts.pattern.gaps == 2);
    CHECK(counts.recent_lost == 0);
    CHECK(counts.recent_expected == StreamStatistics::kRecent);
    CHECK(counts.datagram_ms == Approx(1.0));
}

TEST_CASE("who comes later than the settling time is lost to the pattern alone") {
    StreamStatistics statistics(0s);
    for (std::uint64_t n = 0; n < 3000; ++n) {
        if (n != 1000) statistics.on_datagram(sent_at(n), nth(n, 500), 100);
    }
    statistics.on_datagram(sent_at(3000), nth(1000, 500), 100);
    const StreamCounts counts = statistics.counts(false);
    CHECK(counts.lost == 0);
    CHECK(counts.reorder_farthest == 1999);
    CHECK(counts.pattern.lost() == 1);
}

TEST_CASE("two sources with one SSRC, and one that starts again, are streams of their own") {
    StreamTable table(0s);
    SenderKey one;
    one.source.address[15] = 1;
    SenderKey two = one;
    two.source.address[15] = 2;
    SenderKey again = one;
    again.session[0] = 1;
    for (std::uint64_t n = 0; n < 1000; ++n) {
        table.on_datagram(sent_at(n), one, nth(n, 500), 100);
        table.on_datagram(sent_at(n), two, nth(n, 500, 0, 20'000), 100);  // the same SSRC
    }
    for (std::uint64_t n = 0; n < 500; ++n) {
        if (n % 10 == 5) continue;
        table.on_datagram(sent_at(2000 + n), again, nth(n, 500, 0, 7), 100);
    }
    CHECK(table.counts({one}, false).lost == 0);
    CHECK(table.counts({two}, false).lost == 0);
    const StreamCounts both = table.counts({one, again}, false);
    CHECK(both.lost == 50);
    CHECK(both.pattern.lost() == 50);
    CHECK(both.pattern.longest_run == 1);
    CHECK(both.reordered == 0);
}
