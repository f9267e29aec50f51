// tests/fuzz/receiver_fuzz.cpp: sequences of datagrams into the receiver's core.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "protocol/datagram.hpp"
#include "receiver/session.hpp"
#include "tests/fuzz/receiver_script.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;
using tests::ReceiverScript;
using tests::ScriptStep;

constexpr std::size_t kTightBytes = 20'000;
constexpr std::size_t kTightGroups = 3;

// Not assert: must hold in every build.
void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "does not hold: %s\n", what);
    std::abort();
}

SessionOptions options_of(const ReceiverScript& script) {
    SessionOptions options;
    options.until = static_cast<Until>(script.set_up & 3);
    if ((script.set_up & 4) != 0) {
        options.loss.drop_ellipsoids = 0.3;
        options.loss.drop_vertices = 0.3;
        options.loss.reorder = 0.3;
        options.loss.duplicate = 0.3;
        options.loss.corrupt = 0.1;
    }
    options.pages.all = (script.set_up & 16) != 0;
    if ((script.set_up & 8) != 0) {
        options.limits.groups = kTightGroups;
        options.limits.vertices = 4096;
        options.limits.bytes = kTightBytes;
    }
    return options;
}

// Two ports of one host, and two other hosts.
Source source_of(const ScriptStep& step) {
    const int n = step.control & 3;
    Source source;
    source.address[15] = static_cast<std::uint8_t>(n < 2 ? 1 : n);
    source.port = static_cast<std::uint16_t>(1000 + n);
    return source;
}

Time pause_of(const ScriptStep& step) {
    constexpr std::array<Time, 8> kPauses{0s, 1ms, 20ms, 240ms, 1s, 2s, 5s, 10min};
    return kPauses[step.control >> 2 & 7];
}

std::vector<std::uint8_t> datagram_of(const ScriptStep& step) {
    std::vector<std::uint8_t> bytes = step.datagram;
    if ((step.control & tests::kFixChecksum) != 0 &&
        bytes.size() >= protocol::kHeaderBytes + protocol::kTrailerBytes) {
        const auto number = [&](std::size_t at, int count) {
            std::uint32_t value = 0;
            for (int k = 0; k < count; ++k) value = value << 8 | bytes[at++];
            return value;
        };
        protocol::stamp(bytes, static_cast<std::uint16_t>(number(2, 2)), number(4, 4));
    }
    return bytes;
}

template <class Record>
void check_records(const std::vector<std::uint32_t>& indices, const std::vector<Record>& records,
                   std::uint32_t expected, const protocol::Hint& hint) {
    require(indices.size() == records.size(), "an index for every record");
    require(
        std::is_sorted(indices.begin(), indices.end(), std::less_equal<>()) || indices.size() < 2,
        "indices ascend strictly");
    require(indices.empty() || indices.back() < expected, "indices lie below the hint's count");
    for (const Record& record : records) {
        require(protocol::acceptable(record, hint), "kept records would be accepted again");
    }
}

void check_session(const Session& session, const SessionOptions& options, Time now) {
    const RecordStore& store = session.store();
    require(store.bytes() <= options.limits.bytes, "memory stays below the limit");
    require(store.groups().size() <= options.limits.groups, "groups stay below the limit");
    std::size_t held = 0;
    for (const auto& group : store.groups()) {
        held += group.ellipsoids.bytes() + group.vertices.bytes();
    }
    require(held == store.bytes(), "the budget is what the tables hold");
    const auto& contents = session.catalogue().all();
    require(contents.size() <= options.limits.groups, "tables of contents stay below the limit");
    for (const auto& table : contents) {
        require(table.lines.size() <= options.limits.groups, "their lines do");
        require(table.replaced.size() <= 256, "and what was replaced");
    }
    for (const auto& page : session.pages()) {
        require(!page.versions.empty(), "a page has a version");
    }
    const auto next = session.next_wakeup();
    require(!next || *next >= Time::min() + 1s, "the next wake-up is a time");
    const auto object = store.snapshot();
    require(object.has_value() == !store.groups().empty(), "a group gives an object");
    if (!object) return;
    check_records(object->ellipsoid_index, object->ellipsoids, object->hint.ellipsoids,
                  object->hint);
    check_records(object->vertex_index, object->vertices, object->hint.vertices, object->hint);
    (void)id_matches(*object);
    (void)session.summary(now);
}

using Arrival = std::pair<Source, std::vector<std::uint8_t>>;

std::optional<ReceivedObject> stored(const std::vector<Arrival>& arrivals, bool& undisturbed) {
    RecordStore store;
    for (const auto& [source, bytes] : arrivals) {
        const auto view = protocol::parse_datagram(bytes);
        if (view) store.accept(0s, {source, view->header.session}, *view);
    }
    undisturbed = store.counts().evicted == 0 && store.counts().refused == 0;
    return store.snapshot();
}

// The same datagrams backwards, and each twice, are the same object.
void check_order(std::vector<Arrival> arrivals) {
    bool undisturbed = false;
    const auto forwards = stored(arrivals, undisturbed);
    if (!undisturbed) return;
    std::vector<Arrival> twice;
    for (auto it = arrivals.rbegin(); it != arrivals.rend(); ++it) {
        twice.push_back(*it);
        twice.push_back(*it);
    }
    const auto backwards = stored(twice, undisturbed);
    require(forwards.has_value() == backwards.has_value(), "order changes whether there is one");
    if (!forwards) return;
    require(forwards->id == backwards->id && forwards->hint == backwards->hint &&
                forwards->description == backwards->description &&
                forwards->ellipsoid_index == backwards->ellipsoid_index &&
                forwards->ellipsoids == backwards->ellipsoids &&
                forwards->vertex_index == backwards->vertex_index &&
                forwards->vertices == backwards->vertices,
            "order and copies change nothing");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ReceiverScript script = tests::decode_script({data, size});
    const SessionOptions options = options_of(script);
    Time now = 1s;
    Session session(options, now);
    std::vector<Arrival> arrivals;
    for (const ScriptStep& step : script.steps) {
        now += pause_of(step);
        arrivals.emplace_back(source_of(step), datagram_of(step));
        session.on_datagram(now, arrivals.back().first, arrivals.back().second);
        if ((step.control & tests::kPoll) != 0) session.poll(now);
        require(session.store().bytes() <= options.limits.bytes, "memory stays below the limit");
    }
    check_session(session, options, now);
    session.interrupt(now);
    require(session.finished(), "an interrupted session is finished");
    check_session(session, options, now);
    check_order(std::move(arrivals));
    return 0;
}
