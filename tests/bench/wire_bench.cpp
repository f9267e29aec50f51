// tests/bench/wire_bench.cpp: both ends at their sockets, over the loopback interface, beside loops
// that do nothing but send or receive 1200 bytes.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <future>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "protocol/byte_writer.hpp"
#include "protocol/datagram.hpp"
#include "receiver/live_view.hpp"
#include "receiver/udp_endpoint.hpp"
#include "sender/batch_sending.hpp"
#include "sender/udp_endpoint.hpp"
#include "tests/bench/wire_sockets.hpp"
#include "tests/sender/made_objects.hpp"
#include "tests/support/child_process.hpp"

namespace {

using namespace ellicast;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using bench::Load;
using bench::Sink;

bool small() {
    return std::getenv("ELLICAST_BENCH_SMALL") != nullptr;
}

double seconds_between(Clock::time_point begin, Clock::time_point end) {
    return std::chrono::duration<double>(end - begin).count();
}

// ---- the sending end, unpaced, into a socket that nobody reads

constexpr std::uint32_t kRounds = 40;

std::size_t vertices() {
    return small() ? 5'000 : 500'000;
}

/// What left, and how long it took.
struct Sent {
    std::uint64_t datagrams = 0;
    double seconds = 0.0;
    double cpu_seconds = 0.0;
};

Sent send_session(const Sink& sink) {
    static const sender::BroadcastObject object = tests::made_object(400, vertices());
    sender::PlanOptions plan;
    plan.rounds = kRounds;
    sender::SessionOptions unpaced;
    unpaced.bits_per_second = 0;
    std::vector<sender::RoundPlan> plans{sender::RoundPlan(object, plan)};
    sender::Session session(std::move(plans), unpaced);
    sender::UdpEndpoint endpoint("127.0.0.1", sink.port(), 1200, {.segments = true});
    const double cpu = bench::thread_cpu_seconds();
    const auto begin = Clock::now();
    if (!endpoint.run(session)) throw std::runtime_error("interrupted");
    return {endpoint.counts().sent, seconds_between(begin, Clock::now()),
            bench::thread_cpu_seconds() - cpu};
}

Sent send_bare(const Sink& sink) {
    Load load(sink.port());
    const std::size_t count = small() ? 3'000 : 250'000;
    const double cpu = bench::thread_cpu_seconds();
    const auto begin = Clock::now();
    for (std::size_t sent = 0; sent < count;) sent += load.send_plain(64);
    return {load.sent(), seconds_between(begin, Clock::now()), bench::thread_cpu_seconds() - cpu};
}

void measure_sending(benchmark::State& state, Sent (*send)(const Sink&)) {
    std::uint64_t datagrams = 0;
    double cpu_seconds = 0.0;
    for (auto _ : state) {
        Sink sink(1);  // byte: all but the first are dropped at its door
        const Sent sent = send(sink);
        state.SetIterationTime(sent.seconds);
        datagrams += sent.datagrams;
        cpu_seconds += sent.cpu_seconds;
        if (sink.arrived() != sent.datagrams) {
            state.SkipWithError("not all that was sent arrived");
            return;
        }
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(datagrams));
    state.counters["per_cpu_second"] = static_cast<double>(datagrams) / cpu_seconds;
}

void send_whole(benchmark::State& state) {
    measure_sending(state, send_session);
}
void send_bare_loop(benchmark::State& state) {
    measure_sending(state, send_bare);
}

constexpr int kBufferBytes = 64 << 20;  // as the receiver asks for

// ---- the receiving end: the highest rate at which the kernel drops nothing

/// One object's first round, sent again and again with the numbers that a carousel would have.
class Carousel {
  public:
    Carousel() {
        sender::PlanOptions options;
        options.rounds = 0;
        const sender::RoundPlan plan(tests::made_object(400, vertices()), options);
        for (std::uint32_t k = 0; k < plan.datagrams(); ++k) {
            datagrams_.push_back(plan.datagram(0, k, {}));
        }
    }
    void begin_again() { sent_ = 0; }
    /// At most so many, and at least one; valid until the next call.
    std::span<const std::vector<std::uint8_t>> next(std::size_t most) {
        const std::size_t begin = sent_ % datagrams_.size();
        const std::size_t count = std::min(most, datagrams_.size() - begin);
        const auto round = static_cast<std::uint32_t>(sent_ / datagrams_.size());
        for (std::size_t k = begin; k < begin + count; ++k) {
            constexpr std::size_t kRound = 73;  // WIRE_FORMAT.md section 4.2
            protocol::store_u32(datagrams_[k].data() + kRound, round);
            protocol::stamp(datagrams_[k], static_cast<std::uint16_t>(sent_++), 0);
        }
        return std::span(datagrams_).subspan(begin, count);
    }

  private:
    std::vector<std::vector<std::uint8_t>> datagrams_;
    std::uint64_t sent_ = 0;
};

/// What the load did.
struct Offered {
    std::uint64_t datagrams = 0;
    bool in_time = false;
    double cpu_seconds = 0.0;
};

Offered send_carousel(std::uint16_t port, double datagrams_per_second, double seconds) {
    static Carousel carousel;
    carousel.begin_again();
    const bench::Load socket(port);
    sender::BatchSending sending(true);  // the cheapest load there is
    const auto all = static_cast<std::uint64_t>(datagrams_per_second * seconds);
    Offered offered;
    const double cpu = bench::thread_cpu_seconds();
    const auto begin = Clock::now();
    while (offered.datagrams < all) {
        const double due = datagrams_per_second * seconds_between(begin, Clock::now());
        const double behind =
            std::min(due, static_cast<double>(all)) - static_cast<double>(offered.datagrams);
        if (behind < 16 && due < static_cast<double>(all)) {
            std::this_thread::sleep_for(50us);
            continue;
        }
        const auto count = static_cast<std::size_t>(std::min(behind + 1.0, 64.0));
        const auto datagrams = carousel.next(count);
        if (sending.send(socket.number(), datagrams).error != 0) {
            throw std::runtime_error("the load was refused");
        }
        offered.datagrams += datagrams.size();
    }
    offered.in_time = seconds_between(begin, Clock::now()) < 1.05 * seconds;
    offered.cpu_seconds = bench::thread_cpu_seconds() - cpu;
    return offered;
}

struct Received {
    std::uint64_t datagrams = 0;
    std::uint64_t dropped = 0;  // by the kernel
    bool in_pieces = false;     // of which it counts one where it drops several (UdpEndpoint)
};

/// Tells the port that it listens on, and receives until the stream is over.
using Receiver = std::function<Received(std::promise<std::uint16_t>& port)>;

constexpr auto kSilence = 200ms;

Received receive_bare(std::promise<std::uint16_t>& port) {
    Sink sink(kBufferBytes);
    port.set_value(sink.port());
    const std::uint64_t datagrams = sink.receive_until_silence(10 * kSilence);
    return {datagrams, sink.dropped()};
}

Received receive_session(bool live, std::promise<std::uint16_t>& port) {
    receiver::UdpEndpoint endpoint({.listen = {"127.0.0.1", 0}});
    receiver::SessionOptions options;
    options.until = receiver::Until::forever;
    receiver::Session session(options, receiver::UdpEndpoint::now());
    const tests::TemporaryDirectory directory;
    receiver::LiveOptions how;
    how.file = directory.path() / "live.ply";
    std::optional<receiver::LiveView> view;
    if (live) view.emplace(how);
    const std::string address = endpoint.address();
    port.set_value(static_cast<std::uint16_t>(std::stoul(address.substr(address.rfind(':') + 1))));
    std::uint64_t seen = 0;
    Clock::time_point last = Clock::now();
    const auto end_after_silence = [&](receiver::Time now) {
        const std::uint64_t received = session.summary(now).datagrams.received;
        if (received != seen) last = Clock::now();
        if (received == seen && Clock::now() - last > 10 * kSilence) std::raise(SIGINT);
        seen = received;
    };
    endpoint.run(session, end_after_silence, [&](receiver::Time now) {
        if (view) view->on_arrival(now, session);
    });
    return {session.summary(receiver::UdpEndpoint::now()).datagrams.received,
            endpoint.kernel_dropped(), true};
}

/// What became of a stream of some rate.
struct Trial {
    bool in_time = false;  // the load kept the rate
    std::uint64_t datagrams = 0;
    std::uint64_t dropped = 0;
    double cpu_seconds = 0.0;  // of the receiver
};

/// Throws when datagrams are unaccounted for.
Trial try_rate(const Receiver& receive, double rate, double seconds) {
    const double cpu = bench::process_cpu_seconds();
    std::promise<std::uint16_t> port;
    auto listening = port.get_future();
    auto receiving = std::async(std::launch::async, [&] { return receive(port); });
    const Offered offered = send_carousel(listening.get(), rate, seconds);
    const Received received = receiving.get();
    const std::uint64_t missing = offered.datagrams - received.datagrams;
    const bool accounted =
        received.in_pieces ? (missing > 0) == (received.dropped > 0) : missing == received.dropped;
    if (received.datagrams > offered.datagrams || !accounted) {
        throw std::runtime_error(std::to_string(offered.datagrams) + " sent, " +
                                 std::to_string(received.datagrams) + " received, " +
                                 std::to_string(received.dropped) + " dropped");
    }
    return {offered.in_time, received.datagrams, received.dropped,
            bench::process_cpu_seconds() - cpu - offered.cpu_seconds};
}

/// The highest rate at which nothing is dropped, within 5 %.
void measure_receiving(benchmark::State& state, const Receiver& receive) {
    const char* const asked = std::getenv("ELLICAST_BENCH_SECONDS");
    const double seconds = asked != nullptr ? std::atof(asked) : small() ? 0.05 : 2.0;
    std::uint64_t datagrams = 0;
    double cpu_seconds = 0.0;
    bool by_load = false;
    for (auto _ : state) {
        double good = 0.0;
        double bad = 3e6;
        double rate = small() ? 1e4 : 1e5;
        while (bad > 1.05 * good && rate > 1e3) {
            const Trial trial = try_rate(receive, rate, seconds);
            if (trial.in_time && trial.dropped == 0) {
                good = rate;
                datagrams = trial.datagrams;
                cpu_seconds = trial.cpu_seconds;
                if (small()) break;
                rate = std::min(2 * good, std::sqrt(good * bad));
            } else {
                bad = rate;
                by_load = !trial.in_time;
                rate = good == 0.0 ? rate / 2 : std::sqrt(good * bad);
            }
        }
        state.SetIterationTime(seconds);
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(datagrams));
    state.counters["per_cpu_second"] = static_cast<double>(datagrams) / cpu_seconds;
    state.counters["limited_by_load"] = by_load;
}

void receive_whole(benchmark::State& state) {
    measure_receiving(state, [](auto& port) { return receive_session(false, port); });
}
void receive_live(benchmark::State& state) {
    measure_receiving(state, [](auto& port) { return receive_session(true, port); });
}
void receive_bare_loop(benchmark::State& state) {
    measure_receiving(state, receive_bare);
}

}  // namespace

BENCHMARK(send_whole)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(send_bare_loop)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(receive_whole)->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(receive_live)->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(receive_bare_loop)->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
