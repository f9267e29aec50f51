// tests/bench/secure_bench.cpp: what signing and secrecy cost at both ends, beside plain streams.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <stdexcept>
#include <vector>

#include "receiver/session.hpp"
#include "sender/session.hpp"
#include "tests/sender/made_objects.hpp"

namespace {

using namespace ellicast;

enum Mode : int { plain = 0, sealed = 1, is_signed = 2 };  // or both

sender::StreamKeys keys_of(int mode) {
    sender::StreamKeys keys;
    if ((mode & sealed) != 0) keys.psk.emplace(std::array<std::uint8_t, 32>{1});
    if ((mode & is_signed) != 0) keys.sign = common::SigningKey::of_seed({2});
    return keys;
}

std::vector<sender::RoundPlan> plans_of(const sender::StreamKeys& keys) {
    const std::size_t vertices = std::getenv("ELLICAST_BENCH_SMALL") != nullptr ? 5'000 : 200'000;
    sender::PlanOptions options;
    options.security_bytes = protocol::security_bytes(keys.protection());
    std::vector<sender::RoundPlan> plans;
    plans.emplace_back(tests::made_object(400, vertices), options);
    return plans;
}

/// A round as the sender's core makes it.
std::vector<sender::Datagram> send_all(const std::vector<sender::RoundPlan>& plans,
                                       const sender::StreamKeys& keys) {
    sender::SessionOptions options;
    options.bits_per_second = 0;
    std::optional<sender::DatagramSecurity> security;
    if (keys.protection().any()) security.emplace(keys, protocol::SessionId{}, 1);
    sender::Session session(plans, options, std::move(security));
    std::vector<sender::Datagram> datagrams;
    while (!session.done()) session.poll(std::chrono::seconds(1), datagrams);
    return datagrams;
}

std::size_t bytes_of(const std::vector<sender::Datagram>& datagrams) {
    std::size_t bytes = 0;
    for (const auto& datagram : datagrams) bytes += datagram.size();
    return bytes;
}

struct Stream {
    std::vector<sender::RoundPlan> plans;
    std::vector<sender::Datagram> datagrams;
};

const Stream& stream_of(int mode) {
    static std::map<int, Stream> streams;
    const auto found = streams.find(mode);
    if (found != streams.end()) return found->second;
    const auto keys = keys_of(mode);
    auto plans = plans_of(keys);
    auto datagrams = send_all(plans, keys);
    return streams.emplace(mode, Stream{std::move(plans), std::move(datagrams)}).first->second;
}

void set_counters(benchmark::State& state, const Stream& stream) {
    const auto rounds = static_cast<std::int64_t>(state.iterations());
    state.SetItemsProcessed(rounds * static_cast<std::int64_t>(stream.datagrams.size()));
    state.SetBytesProcessed(rounds * static_cast<std::int64_t>(bytes_of(stream.datagrams)));
}

/// As the program feeds its session: what one turn takes from the socket, then a batch of work.
receiver::SessionSummary receive_all(const Stream& stream,
                                     const receiver::SessionOptions& options) {
    constexpr std::size_t kTurn = 128;
    const receiver::Time now = std::chrono::seconds(1);
    receiver::Session session(options, now);
    for (std::size_t k = 0; k < stream.datagrams.size(); ++k) {
        session.on_datagram(now, {}, stream.datagrams[k]);
        if (k % kTurn == kTurn - 1) session.work();
    }
    session.interrupt(now);
    if (session.ends_by() != receiver::EndReason::complete) {
        throw std::logic_error("not all was received");
    }
    return session.summary(now);
}

/// Arguments: mode, threads.
void receive_stream(benchmark::State& state) {
    const int mode = static_cast<int>(state.range(0));
    const Stream& stream = stream_of(mode);
    const auto keys = keys_of(mode);
    receiver::SessionOptions options;
    options.gate.psk = keys.psk;
    if (keys.sign) options.gate.verify = {keys.sign->public_key()};
    options.gate.threads = static_cast<unsigned>(state.range(1));
    const auto summary = receive_all(stream, options);
    if (summary.authenticity.verified() != keys.sign.has_value() || summary.datagrams.lost != 0) {
        throw std::logic_error("what was received is not what was sent");
    }
    for (auto _ : state) benchmark::DoNotOptimize(receive_all(stream, options));
    set_counters(state, stream);
}

/// Argument: mode. The sender works on one core.
void send_stream(benchmark::State& state) {
    const int mode = static_cast<int>(state.range(0));
    const Stream& stream = stream_of(mode);
    const auto keys = keys_of(mode);
    for (auto _ : state) benchmark::DoNotOptimize(send_all(stream.plans, keys));
    set_counters(state, stream);
}

}  // namespace

BENCHMARK(send_stream)
    ->Arg(plain)
    ->Arg(sealed)
    ->Arg(is_signed)
    ->Arg(sealed | is_signed)
    ->Unit(benchmark::kMillisecond);
// On one core by its own time, on two by the clock.
BENCHMARK(receive_stream)
    ->Args({plain, 1})
    ->Args({sealed, 1})
    ->Args({is_signed, 1})
    ->Args({sealed | is_signed, 1})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(receive_stream)
    ->Args({is_signed, 2})
    ->Args({sealed | is_signed, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
