#include "receiver/datagram_ring.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <thread>
#include <vector>

#include "common/random.hpp"

namespace ellicast::receiver {
namespace {

constexpr std::size_t kSmallest = DatagramRing::kLeastBytes;

std::vector<std::uint8_t> bytes_of(std::size_t size, std::uint64_t number) {
    std::vector<std::uint8_t> bytes(size);
    for (std::size_t k = 0; k < size; ++k) bytes[k] = static_cast<std::uint8_t>(number + 3 * k);
    return bytes;
}

Source source_of(std::uint64_t number) {
    Source source;
    source.port = static_cast<std::uint16_t>(number);
    source.address[15] = static_cast<std::uint8_t>(number);
    return source;
}

bool push(DatagramRing& ring, std::size_t size, std::uint64_t number) {
    const std::vector<std::uint8_t> bytes = bytes_of(size, number);
    return ring.push({Time(number), source_of(number), bytes});
}

bool is(const Arrival& arrival, std::size_t size, std::uint64_t number) {
    const std::vector<std::uint8_t> bytes = bytes_of(size, number);
    return arrival.time == Time(number) && arrival.source == source_of(number) &&
           std::equal(arrival.bytes.begin(), arrival.bytes.end(), bytes.begin(), bytes.end());
}

/// From 0 to kMaxDatagram, small ones most often.
std::size_t size_of(common::Random& random) {
    return random.below(std::size_t{1} << random.below(17)) + random.below(2);
}

}  // namespace

TEST_CASE("nothing is there before it was published") {
    DatagramRing ring(kSmallest);
    CHECK(ring.empty());
    REQUIRE(push(ring, 100, 1));
    CHECK(ring.empty());
    ring.publish();
    CHECK_FALSE(ring.empty());
}

TEST_CASE("taking stops at the number asked for, and where the visitor has enough") {
    DatagramRing ring(kSmallest);
    for (std::uint64_t k = 0; k < 10; ++k) REQUIRE(push(ring, 0, k));
    ring.publish();
    std::uint64_t next = 0;
    const auto visit = [&](const Arrival& arrival) { return is(arrival, 0, next++); };
    CHECK(ring.take(4, visit) == 4);
    CHECK(ring.take(4, [&](const Arrival& arrival) { return visit(arrival) && next < 6; }) == 2);
    CHECK(ring.take(100, visit) == 4);
    CHECK(next == 10);
    CHECK(ring.empty());
    CHECK(ring.take(1, visit) == 0);
}

TEST_CASE("a full ring takes nothing more, and keeps what it has") {
    DatagramRing ring(kSmallest);
    std::uint64_t pushed = 0;
    while (push(ring, 1200, pushed)) ++pushed;
    CHECK(pushed >= kSmallest / 1408 - 1);
    CHECK_FALSE(push(ring, 1200, pushed));
    ring.publish();
    std::uint64_t taken = 0;
    ring.take(1, [&](const Arrival& arrival) { return is(arrival, 1200, taken++); });
    REQUIRE(push(ring, 1200, pushed++));
    ring.publish();
    while (!ring.empty()) {
        ring.take(7, [&](const Arrival& arrival) {
            const bool right = is(arrival, 1200, taken++);
            CHECK(right);
            return right;
        });
    }
    CHECK(taken == pushed);
}

TEST_CASE("the largest datagram fits into an empty ring, wherever it stands") {
    DatagramRing ring(kSmallest);
    for (std::uint64_t k = 0; k < 40; ++k) {
        const std::size_t size = k % 2 == 0 ? DatagramRing::kMaxDatagram : 5000 + 997 * k;
        REQUIRE(push(ring, size, k));
        ring.publish();
        bool right = false;
        CHECK(ring.take(2, [&](const Arrival& a) { return right = is(a, size, k); }) == 1);
        CHECK(right);
    }
}

TEST_CASE("rewound, an empty ring has all its room, and begins where it began") {
    DatagramRing ring(kSmallest);
    const std::uint8_t* front = nullptr;
    std::uint64_t number = 0;
    std::uint64_t taken = 0;
    const auto visit = [&](const Arrival& arrival) {
        const bool right = is(arrival, 1200, taken++);
        CHECK(right);
        return right;
    };
    for (int round = 0; round < 5; ++round) {
        ring.rewind();
        std::uint64_t fit = 0;
        while (push(ring, 1200, number)) {
            ++number;
            ++fit;
            ring.publish();
            if (fit == 3) ring.rewind();  // not empty: does nothing
        }
        CHECK(fit >= kSmallest / 1408 - 1);
        ring.take(1, [&](const Arrival& arrival) {
            if (front == nullptr) front = arrival.bytes.data();
            CHECK(arrival.bytes.data() == front);
            return visit(arrival);
        });
        while (ring.take(7, visit) > 0) {
        }
        CHECK(taken == number);
        CHECK(ring.empty());
        ring.rewind();
        ring.rewind();
        CHECK(ring.empty());
    }
}

TEST_CASE("between two threads everything comes through, once and in order") {
    constexpr std::uint64_t kDatagrams = 20'000;
    const bool rewinding = GENERATE(false, true);
    DatagramRing ring(kSmallest + 12'345);
    std::thread putting([&] {
        common::Random random(5);
        for (std::uint64_t k = 0; k < kDatagrams; ++k) {
            const std::size_t size = size_of(random);
            while (!push(ring, size, k)) {
                ring.publish();
                std::this_thread::yield();
            }
            if (random.below(8) != 0) continue;
            ring.publish();
            if (rewinding) ring.rewind();
        }
        ring.publish();
    });
    common::Random random(5);
    std::uint64_t right = 0;
    for (std::uint64_t k = 0; k < kDatagrams;) {
        const std::size_t taken = ring.take(16, [&](const Arrival& arrival) {
            right += is(arrival, size_of(random), k++);
            if (k < kDatagrams) random.below(8);
            return true;
        });
        if (taken == 0) std::this_thread::yield();
    }
    putting.join();
    CHECK(right == kDatagrams);
}

}  // namespace ellicast::receiver
