// tests/common/token_bucket_test.cpp
#include "common/token_bucket.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numeric>

#include "common/random.hpp"

namespace ellicast::common {
namespace {

using Time = TokenBucket::Time;
using namespace std::chrono_literals;

}  // namespace

TEST_CASE("under steady demand the k-th datagram leaves when the bits before it are paid") {
    const std::uint64_t rate = GENERATE(1u, 999u, 100'000u, 20'000'000u, 1'000'000'000u);
    const std::size_t bytes = GENERATE(1u, 604u, 1248u, 65'555u);
    const Time epoch = GENERATE(Time(0), Time(1'234'567'891'234'567), Time(-5'000'000'000));
    TokenBucket bucket(rate, 5ms);
    CHECK(bucket.ready_at() == Time::min());
    Time now = epoch;
    for (std::uint64_t k = 0; k < 1000; ++k) {
        // Closed form: ceil(k * bits / rate) ns, in exact integers.
        __extension__ using Wide = unsigned __int128;
        const Wide bits = Wide{8} * bytes * k * 1'000'000'000u;
        const auto due = epoch + Time(static_cast<std::int64_t>((bits + rate - 1) / rate));
        if (k > 0) {
            now = bucket.ready_at();
            REQUIRE(now == due);
            REQUIRE_FALSE(bucket.take(now - 1ns, bytes));
        }
        REQUIRE(bucket.take(now, bytes));
    }
}

TEST_CASE("how often and when the bucket is asked does not change the rate over a second") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u, 4u, 5u);
    const std::uint64_t rate = GENERATE(100'000u, 20'000'000u, 1'000'000'000u);
    CAPTURE(seed, rate);
    Random random(seed);
    TokenBucket bucket(rate, 5ms);
    std::uint64_t bytes = 0;
    Time now{0};
    while (now < 1s) {
        while (bucket.take(now, 1248)) bytes += 1248;
        now += Time(static_cast<std::int64_t>(random.below(4'900'000)));  // wakes late, within 5 ms
    }
    const double bits = 8.0 * static_cast<double>(bytes);
    const double expected = static_cast<double>(rate);
    CHECK(bits <= expected * 1.005 + 2 * 8 * 1248);
    CHECK(bits >= expected * 0.99 - 2 * 8 * 1248);
}

TEST_CASE("every second carries the rate to 2 %, or to a datagram, however late we wake") {
    const std::uint64_t rate =
        GENERATE(100'000u, 1'000'000u, 10'000'000u, 100'000'000u, 1'000'000'000u);
    const Time latest = GENERATE(Time(0ms), Time(1ms), Time(4ms));
    CAPTURE(rate, latest.count());
    constexpr std::size_t kBytes = 1228;
    constexpr Time kLeastSleep = 200us;  // as the sender sleeps
    constexpr Time kBurst = 5ms;
    constexpr Time kSlot = 250ms;  // windows of a second begin at every quarter of one
    constexpr std::size_t kSlots = 4;
    constexpr Time kEnd = 6s;
    Random random(rate + static_cast<std::uint64_t>(latest.count()));
    TokenBucket bucket(rate, kBurst);
    std::array<double, kEnd / kSlot> bits{};
    double most_at_once = 0;
    for (Time now{0}; now < kEnd;) {
        double at_once = 0;
        while (bucket.take(now, kBytes)) at_once += 8.0 * kBytes;
        bits.at(static_cast<std::size_t>(now / kSlot)) += at_once;
        most_at_once = std::max(most_at_once, at_once);
        now = std::max(bucket.ready_at(), now + kLeastSleep);
        const auto within = static_cast<std::uint64_t>(latest.count()) + 1;
        now += Time(static_cast<std::int64_t>(random.below(within)));
    }
    // Of 100 kbit/s a datagram is a tenth of a second's bits: no second can be fairer than that.
    const double asked = static_cast<double>(rate);
    const double allowed = std::max(0.02 * asked, 8.0 * kBytes);
    for (std::size_t first = 0; first + kSlots <= bits.size(); ++first) {
        const auto* const begin = bits.data() + first;
        const double second = std::accumulate(begin, begin + kSlots, 0.0);
        CAPTURE(first);
        CHECK(std::abs(second - asked) <= allowed);
    }
    const double all = std::accumulate(bits.begin(), bits.end(), 0.0);
    CHECK(all == Approx(6.0 * asked).epsilon(0.02));
    CHECK(most_at_once <= asked * 0.005 + 8.0 * kBytes);  // the burst is bounded
}

TEST_CASE("no stretch of time carries more than rate times stretch and burst, and a datagram") {
    const std::uint64_t seed = GENERATE(11u, 12u, 13u);
    CAPTURE(seed);
    Random random(seed);
    const std::uint64_t rate = 8'000'000;  // 1 byte a microsecond
    const Time burst = 3ms;
    TokenBucket bucket(rate, burst);
    struct Sent {
        Time at;
        std::uint64_t bytes;
    };
    std::deque<Sent> sent;
    Time now{0};
    for (int k = 0; k < 3000; ++k) {
        now += Time(
            static_cast<std::int64_t>(random.below(random.chance(0.02) ? 40'000'000 : 900'000)));
        const std::size_t bytes = 100 + random.below(1100);
        if (bucket.take(now, bytes)) sent.push_back({now, bytes});
    }
    for (std::size_t first = 0; first < sent.size(); ++first) {
        std::uint64_t bytes = 0;
        for (std::size_t last = first; last < std::min(sent.size(), first + 200); ++last) {
            // All but the last datagram must have been paid by then.
            const auto paid =
                static_cast<std::uint64_t>((sent[last].at - sent[first].at + burst).count() / 1000);
            REQUIRE(bytes <= paid + 1);
            bytes += sent[last].bytes;
        }
    }
}

TEST_CASE("idle time gives credit for the burst and no more") {
    TokenBucket bucket(8'000'000, 10ms);  // 1000 bytes a millisecond
    REQUIRE(bucket.take(0ms, 1000));
    int at_once = 0;
    while (bucket.take(1h, 1000)) ++at_once;
    CHECK(at_once == 11);  // ten for 10 ms, and the one that makes the debt
    CHECK(bucket.ready_at() == 1h + 1ms);
}

TEST_CASE("time that goes backwards gives nothing and breaks nothing") {
    TokenBucket bucket(8'000'000, 0ms);
    REQUIRE(bucket.take(5s, 1000));
    CHECK_FALSE(bucket.take(1s, 1000));
    CHECK(bucket.ready_at() == 5s + 1ms);
    CHECK(bucket.take(5s + 1ms, 1000));
}

}  // namespace ellicast::common
