// tests/bench/datagram_bench.cpp: datagrams in, records and counts out, beside a copy of the bytes.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "receiver/record_store.hpp"
#include "receiver/stream_statistics.hpp"
#include "sender/round_plan.hpp"
#include "tests/sender/made_objects.hpp"

namespace {

using namespace ellicast;
using receiver::Time;

/// One round of a made object, each datagram as a sender with default options makes it.
struct Round {
    sender::BroadcastObject object;
    std::vector<std::vector<std::uint8_t>> datagrams;
    std::size_t bytes = 0;
};

Round make_round(std::uint8_t normal_bits) {
    const std::size_t vertices = std::getenv("ELLICAST_BENCH_SMALL") != nullptr ? 5'000 : 500'000;
    Round round{tests::made_object(400, vertices), {}, 0};
    round.object.hint.format.normal_bits = normal_bits;
    for (std::size_t k = 0; k < vertices; ++k) {
        round.object.vertices[k].normal =
            static_cast<std::uint16_t>(k % (std::size_t{1} << normal_bits));
    }
    const sender::RoundPlan plan(round.object, {});
    for (std::uint32_t ordinal = 0; ordinal < plan.datagrams(); ++ordinal) {
        const auto sequence = static_cast<std::uint16_t>(ordinal);
        round.datagrams.push_back(plan.datagram(0, ordinal, {sequence, 90 * ordinal, 7}));
        round.bytes += round.datagrams.back().size();
    }
    return round;
}

/// The receiver's work on a datagram, all but the socket.
struct Books {
    receiver::RecordStore store;
    receiver::StreamTable streams{Time::zero()};

    void take(Time now, const std::vector<std::uint8_t>& bytes) {
        const auto datagram = protocol::parse_datagram(bytes);
        if (!datagram) throw std::logic_error("a datagram was refused");
        const receiver::SenderKey sender{{}, datagram->header.session};
        if (!store.accept(now, sender, *datagram)) throw std::logic_error("over the limits");
        streams.on_datagram(now, sender, datagram->header, bytes.size());
    }
};

void take_all(Books& books, const Round& round) {
    Time now{};
    for (const auto& bytes : round.datagrams) {
        books.take(now, bytes);
        now += std::chrono::microseconds(1);
    }
}

void require_all_there(const Books& books, const Round& round) {
    const auto object = books.store.snapshot();
    const auto counts = books.streams.counts(books.store.shown()->senders, true);
    if (!object || object->vertices != round.object.vertices ||
        object->ellipsoids != round.object.ellipsoids) {
        throw std::logic_error("what was received is not what was sent");
    }
    if (counts.received != round.datagrams.size() || counts.lost != 0 || counts.duplicate != 0) {
        throw std::logic_error("the counts are wrong");
    }
}

void set_counters(benchmark::State& state, const Round& round) {
    const auto done = static_cast<std::int64_t>(state.iterations());
    state.SetItemsProcessed(done * static_cast<std::int64_t>(round.datagrams.size()));
    state.SetBytesProcessed(done * static_cast<std::int64_t>(round.bytes));
}

/// Made once for each number of bits.
const Round& round_of(const benchmark::State& state) {
    static std::map<std::uint8_t, Round> rounds;
    const auto bits = static_cast<std::uint8_t>(state.range(0));
    const auto found = rounds.find(bits);
    return found != rounds.end() ? found->second
                                 : rounds.emplace(bits, make_round(bits)).first->second;
}

/// A new receiver hears a whole round.
void decode_and_keep(benchmark::State& state) {
    const Round& round = round_of(state);
    {
        Books books;
        take_all(books, round);
        require_all_there(books, round);
    }
    for (auto _ : state) {
        Books books;
        take_all(books, round);
        benchmark::DoNotOptimize(books.store.bytes());
    }
    set_counters(state, round);
}

/// A receiver hears what it has already: a carousel's later rounds.
void decode_repeated(benchmark::State& state) {
    const Round& round = round_of(state);
    Books books;
    take_all(books, round);
    require_all_there(books, round);
    for (auto _ : state) take_all(books, round);
    set_counters(state, round);
}

void decode_only(benchmark::State& state) {
    const Round& round = round_of(state);
    std::size_t sections = 0;
    for (auto _ : state) {
        for (const auto& bytes : round.datagrams) {
            const auto datagram = protocol::parse_datagram(bytes);
            if (!datagram) throw std::logic_error("a datagram was refused");
            sections += datagram->section_count;
        }
    }
    benchmark::DoNotOptimize(sections);
    set_counters(state, round);
}

void copy_bytes(benchmark::State& state) {
    const Round& round = round_of(state);
    std::vector<std::uint8_t> copy(round.bytes);
    for (auto _ : state) {
        std::uint8_t* out = copy.data();
        for (const auto& bytes : round.datagrams) {
            std::memcpy(out, bytes.data(), bytes.size());
            out += bytes.size();
        }
        benchmark::ClobberMemory();
    }
    set_counters(state, round);
}

/// The sending end: a round's datagrams made, one after another.
void make_datagrams(benchmark::State& state) {
    const Round& round = round_of(state);
    const sender::RoundPlan plan(round.object, {});
    for (auto _ : state) {
        for (std::uint32_t ordinal = 0; ordinal < plan.datagrams(); ++ordinal) {
            const auto sequence = static_cast<std::uint16_t>(ordinal);
            benchmark::DoNotOptimize(plan.datagram(0, ordinal, {sequence, 90 * ordinal, 7}));
        }
    }
    set_counters(state, round);
}

}  // namespace

// Normal bits: none, and the sender's default.
BENCHMARK(copy_bytes)->Arg(0)->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(decode_and_keep)->Arg(0)->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(decode_repeated)->Arg(0)->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(decode_only)->Arg(0)->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(make_datagrams)->Arg(0)->Arg(8)->Unit(benchmark::kMillisecond);
