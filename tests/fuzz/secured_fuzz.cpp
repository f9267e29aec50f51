// tests/fuzz/secured_fuzz.cpp: the authenticated path. Scripts are those of receiver_fuzz, but
// their datagrams are contents: they are sealed and signed with known keys before they go in, so
// that what lies behind tag and signature is reached with any content.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <utility>

#include "protocol/datagram.hpp"
#include "receiver/session.hpp"
#include "sender/datagram_security.hpp"
#include "tests/fuzz/receiver_script.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;
using tests::ReceiverScript;
using tests::ScriptStep;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kTamper = 1 << 7;  // of a step: one bit is flipped after signing

// Not assert: must hold in every build.
void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "does not hold: %s\n", what);
    std::abort();
}

sender::StreamKeys keys_of(const ReceiverScript& script) {
    sender::StreamKeys keys;
    const bool sealed = (script.set_up & 1) != 0;
    if (sealed) keys.psk.emplace(std::array<std::uint8_t, 32>{1, 2, 3});
    if (!sealed || (script.set_up & 2) != 0) {
        keys.sign = common::SigningKey::of_seed(std::array<std::uint8_t, 32>{4, 5, 6});
    }
    return keys;
}

GateOptions gate_of(const ReceiverScript& script, const sender::StreamKeys& keys) {
    GateOptions options;
    options.psk = keys.psk;
    if (keys.sign) options.verify = {keys.sign->public_key()};
    options.refuse_older_sessions = (script.set_up & 4) != 0;
    options.threads = 1;
    return options;
}

Source source_of(const ScriptStep& step) {
    Source source;
    source.address[15] = static_cast<std::uint8_t>(step.control & 3);
    return source;
}

/// A step as it arrives, and what must come of it.
struct Arrival {
    Bytes bytes;
    std::uint64_t start_us = 0;
    std::optional<Bytes> clear;  // that the gate must give; empty: nothing may get in
};

Arrival arrival_of(const ScriptStep& step, const sender::StreamKeys& keys) {
    Arrival arrival;
    arrival.bytes = step.datagram;
    if ((step.control & tests::kFixChecksum) == 0) return arrival;
    Bytes clear = step.datagram;
    clear.resize(std::max(clear.size(), protocol::kHeaderBytes + protocol::kTrailerBytes));
    clear[13] = static_cast<std::uint8_t>(clear[13] & ~6);  // protection is not the content's
    protocol::SessionId session{};
    std::copy_n(clear.begin() + 14, session.size(), session.begin());
    arrival.start_us = 1000u + session[0];
    sender::DatagramSecurity security(keys, session, arrival.start_us);
    arrival.bytes = security.secure(clear, step.control);
    if ((step.control & kTamper) != 0) {
        // Somewhere that depends on the content alone.
        const std::size_t bit =
            (clear[88] + std::size_t{251} * clear[clear.size() / 2]) % (8 * arrival.bytes.size());
        arrival.bytes[bit / 8] = static_cast<std::uint8_t>(arrival.bytes[bit / 8] ^ 1 << bit % 8);
        return arrival;
    }
    // What the gate looks at itself; all else is the parser's.
    if (clear[0] != 0x80 || clear[12] != 1 || (clear[13] & ~1) != 0) return arrival;
    const auto number = [&](std::size_t at, int count) {
        std::uint32_t value = 0;
        for (int k = 0; k < count; ++k) value = value << 8 | clear[at++];
        return value;
    };
    protocol::stamp(clear, static_cast<std::uint16_t>(number(2, 2)), number(4, 4));
    arrival.clear = std::move(clear);
    return arrival;
}

/// One after another through a gate: each gets in as its clear form, or not at all.
void check_gate(const std::vector<Arrival>& arrivals, const GateOptions& options) {
    DatagramGate gate(options);
    std::uint64_t newest = 0;
    for (const Arrival& arrival : arrivals) {
        std::optional<Bytes> got;
        const auto deliver = [&](Time, const Source& source, std::span<const std::uint8_t> clear) {
            require(!got, "a datagram gets in once");
            require(source.authenticity.verified() == !options.verify.empty(),
                    "what was verified is said to be, and nothing else");
            got.emplace(clear.begin(), clear.end());
        };
        (void)gate.offer(1s, {}, arrival.bytes, deliver);
        while (gate.work(deliver)) continue;
        const bool old = options.refuse_older_sessions && arrival.start_us < newest;
        require(got == (old ? std::nullopt : arrival.clear), "what gets in is what was sent");
        if (got) newest = std::max(newest, arrival.start_us);
    }
}

/// All at once into a session whose queue is small.
void check_session(const ReceiverScript& script, const std::vector<Arrival>& arrivals,
                   GateOptions gate) {
    SessionOptions options;
    options.until = Until::forever;
    options.limits.bytes = 100'000;
    gate.queue = (script.set_up & 8) != 0 ? 3 : 4096;
    gate.queue_bytes = 20'000;
    Session session(options, gate, 1s);
    Time now = 1s;
    std::uint64_t most = 0;
    for (std::size_t k = 0; k < arrivals.size(); ++k) {
        session.on_datagram(now, source_of(script.steps[k]), arrivals[k].bytes);
        require(session.gate().waiting() <= gate.queue, "the queue is bounded");
        if ((script.steps[k].control & tests::kPoll) != 0) session.work();
        now += 1ms;
        most += arrivals[k].clear ? 1 : 0;
    }
    session.interrupt(now);
    require(session.gate().waiting() == 0, "an ended session has looked at everything");
    require(session.gate().admitted() <= most, "nobody gets in without the keys");
    require(session.store().bytes() <= options.limits.bytes, "memory stays below the limit");
    for (const auto& group : session.store().groups()) {
        require(group.sender.source.authenticity.verified() == !gate.verify.empty(),
                "groups are of verified keys alone");
    }
    (void)session.summary(now);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    ReceiverScript script = tests::decode_script({data, size});
    if (script.steps.size() > 64) script.steps.resize(64);
    const sender::StreamKeys keys = keys_of(script);
    const GateOptions gate = gate_of(script, keys);
    std::vector<Arrival> arrivals;
    for (const ScriptStep& step : script.steps) arrivals.push_back(arrival_of(step, keys));
    check_gate(arrivals, gate);
    check_session(script, arrivals, gate);
    return 0;
}
