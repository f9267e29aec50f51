#include "sender/rate_watch.hpp"

#include <catch2/catch.hpp>
#include <cstdint>

namespace ellicast::sender {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kRate = 10'000'000;
constexpr std::size_t kDatagram = 1228;

/// Looks at a stream every 200 ms.
struct Stream {
    RateWatch watch{kRate, kDatagram};
    Time now = 77h;
    double bytes = 5e9;
    bool kept = true;

    /// Sends at a share of the rate for so long.
    void send(double share, Time duration) {
        for (const Time end = now + duration; now < end;) {
            kept = watch.look(now, static_cast<std::uint64_t>(bytes));
            if (!kept) return;
            now += 200ms;
            bytes += share * static_cast<double>(kRate) / 8.0 * 0.2;
        }
    }
};

}  // namespace

TEST_CASE("a rate that is kept to nine tenths is kept") {
    Stream stream;
    stream.send(GENERATE(0.91, 1.0, 1.005), 60s);
    CHECK(stream.kept);
    CHECK_FALSE(stream.watch.achieved());
}

TEST_CASE("three whole seconds below nine tenths decide, and say what was achieved") {
    Stream stream;
    const Time before = GENERATE(0s, 10s);
    stream.send(1.0, before);
    const Time begun = stream.now;
    const double share = GENERATE(0.0, 0.3, 0.88);
    stream.send(share, 60s);
    CHECK_FALSE(stream.kept);
    CHECK(stream.now - begun >= 3s);
    CHECK(stream.now - begun <= 4s + 400ms);
    CHECK(stream.watch.achieved().value() ==
          Approx(share * static_cast<double>(kRate)).margin(0.07 * static_cast<double>(kRate)));
    CHECK_FALSE(stream.watch.look(stream.now + 1s, std::uint64_t{1} << 40));
}

TEST_CASE("two slow seconds and a good one, again and again, are hiccups") {
    Stream stream;
    stream.send(1.0, 1s);
    for (int k = 0; k < 20; ++k) {
        stream.send(0.5, 2s);
        stream.send(1.0, 2s);
    }
    CHECK(stream.kept);
}

TEST_CASE("a time in which nobody looked says nothing") {
    Stream stream;
    for (int k = 0; k < 10; ++k) {
        stream.send(0.2, 2s);
        stream.now += 5s;
    }
    CHECK(stream.kept);
}

TEST_CASE("an unpaced stream may be as slow as it likes") {
    RateWatch watch(0, kDatagram);
    for (int k = 0; k < 100; ++k) CHECK(watch.look(k * 200ms, 1));
}

TEST_CASE("a stream of a datagram in many seconds is not called slow") {
    // 1228 bytes at 100 bit/s are one datagram in 98 s; at 9 kbit/s, one in 1.09 s.
    const std::uint64_t rate = GENERATE(1u, 100u, 9'000u, 50'000u);
    RateWatch watch(rate, kDatagram);
    bool kept = true;
    for (Time now = 0s; now < 300s; now += 200ms) {
        const auto paid = static_cast<std::uint64_t>(now.count()) * rate / 8 / 1'000'000'000;
        kept = watch.look(now, (paid / kDatagram + 1) * kDatagram) && kept;
    }
    CHECK(kept);
}

TEST_CASE("a stream that stands still is noticed, however slow it was to be") {
    RateWatch watch(100'000, kDatagram);
    bool kept = true;
    for (Time now = 0s; now < 10s; now += 200ms) kept = watch.look(now, 40 * kDatagram);
    CHECK_FALSE(kept);
}

}  // namespace ellicast::sender
