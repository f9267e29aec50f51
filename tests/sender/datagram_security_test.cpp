#include "sender/datagram_security.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <map>
#include <string>

#include "sender/session.hpp"
#include "tests/sender/made_objects.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::sender;
using namespace std::chrono_literals;

constexpr protocol::SessionId kSession{8, 7, 6, 5, 4, 3, 2, 1};
constexpr std::uint64_t kStart = 1'700'000'000'000'000;

StreamKeys keys(bool sealed, bool is_signed) {
    StreamKeys keys;
    if (sealed) keys.psk.emplace(std::array<std::uint8_t, 32>{1});
    if (is_signed) keys.sign = common::SigningKey::of_seed({2});
    return keys;
}

PlanOptions plan_options(const StreamKeys& stream_keys, std::uint32_t rounds = 2) {
    PlanOptions options;
    options.datagram_bytes = 700;
    options.rounds = rounds;
    options.session = kSession;
    options.security_bytes = protocol::security_bytes(stream_keys.protection());
    return options;
}

std::vector<Datagram> sent(const StreamKeys& stream_keys, const SessionOptions& options = {}) {
    std::vector<RoundPlan> plans;
    plans.emplace_back(tests::made_object(60, 900), plan_options(stream_keys));
    std::optional<DatagramSecurity> security;
    if (stream_keys.protection().any()) security.emplace(stream_keys, kSession, kStart);
    Session session(std::move(plans), options, std::move(security));
    std::vector<Datagram> all;
    Time now = 5s;
    while (!session.done()) {
        session.poll(now, all);
        now = std::max(now, session.next_wakeup());
    }
    return all;
}

/// What a holder of all keys reads; empty when anything is wrong.
std::optional<Datagram> opened(const Datagram& datagram, const StreamKeys& stream_keys) {
    const auto view = protocol::read_secured(datagram);
    if (!view) return std::nullopt;
    Datagram sections(view->parts.sections.begin(), view->parts.sections.end());
    if (stream_keys.psk) {
        const common::SessionSeal seal(*stream_keys.psk, view->session);
        if (!seal.open(view->security.counter, view->parts.associated, view->parts.sections,
                       view->parts.tag.first<16>(), sections)) {
            return std::nullopt;
        }
    }
    if (stream_keys.sign && !common::verifies(stream_keys.sign->public_key(), view->covered,
                                              view->parts.signature.first<64>())) {
        return std::nullopt;
    }
    return protocol::make_clear(*view, sections);
}

}  // namespace

TEST_CASE(
    "secured datagrams fill what they were given, open with the keys, and are a whole round") {
    const bool sealed = GENERATE(true, false);
    const bool is_signed = GENERATE(true, false);
    const StreamKeys stream_keys = keys(sealed, is_signed);
    const auto datagrams = sent(stream_keys);
    std::size_t vertices = 0;
    std::size_t largest = 0;
    for (const Datagram& datagram : datagrams) {
        largest = std::max(largest, datagram.size());
        CHECK(protocol::protection_of(datagram) == stream_keys.protection());
        const auto clear =
            stream_keys.protection().any() ? opened(datagram, stream_keys) : datagram;
        REQUIRE(clear);
        const auto view = protocol::parse_datagram(*clear);
        REQUIRE(view);
        CHECK(view->header.session == kSession);
        for (const auto& section : view->sections()) {
            if (section.kind == protocol::SectionKind::vertices) vertices += section.count;
        }
    }
    CHECK(vertices == 2 * 900);
    CHECK((largest <= 700 && largest > 680));
}

TEST_CASE("a counter never comes twice, and copies are the same bytes") {
    SessionOptions options;
    options.impairment.duplicate = 0.5;
    options.impairment.reorder = 0.3;
    const auto datagrams = sent(keys(true, false), options);
    std::map<std::uint64_t, std::string> by_counter;
    for (const Datagram& datagram : datagrams) {
        const auto view = protocol::read_secured(datagram);
        REQUIRE(view);
        const std::string bytes(datagram.begin(), datagram.end());
        CHECK(by_counter.emplace(view->security.counter, bytes).first->second == bytes);
    }
    CHECK(by_counter.size() < datagrams.size());
    CHECK(by_counter.begin()->first == 0);
    CHECK(by_counter.rbegin()->first == by_counter.size() - 1);
}

TEST_CASE("session start and sending times follow the sender's clock") {
    SessionOptions options;
    options.bits_per_second = 100'000;
    const auto datagrams = sent(keys(false, true), options);
    std::uint64_t last = 0;
    for (const Datagram& datagram : datagrams) {
        const auto view = protocol::read_secured(datagram);
        REQUIRE(view);
        CHECK(view->security.session_start_us == kStart);
        CHECK(view->security.sent_us >= last);
        last = view->security.sent_us;
    }
    double bits = 0;
    for (const Datagram& datagram : datagrams)
        bits += 8.0 * static_cast<double>(datagram.size() + 28);
    // The rate is that of secured datagrams, not of what was in them.
    CHECK(static_cast<double>(last - kStart) / 1e6 == Approx(bits / 100'000).epsilon(0.02));
}

TEST_CASE("sections that are lost on purpose are lost before they are sealed") {
    SessionOptions options;
    options.impairment.drop_vertices = 0.5;
    const StreamKeys stream_keys = keys(true, true);
    std::size_t vertices = 0;
    for (const Datagram& datagram : sent(stream_keys, options)) {
        const auto clear = opened(datagram, stream_keys);
        REQUIRE(clear);
        const auto view = protocol::parse_datagram(*clear);
        REQUIRE(view);
        for (const auto& section : view->sections()) {
            if (section.kind == protocol::SectionKind::vertices) vertices += section.count;
        }
    }
    CHECK((vertices > 0 && vertices < 1500));
}

TEST_CASE("the smallest datagram holds a long name's beginning, a record, seal and signature") {
    auto object = tests::made_object(20, 50);
    std::string& name = object.description.name;
    name.clear();
    while (name.size() < 254) name += "\u00e9";
    PlanOptions options = plan_options(keys(true, true));
    options.datagram_bytes = protocol::kMinDatagramBytes;
    const RoundPlan plan(object, options);
    DatagramSecurity security(keys(true, true), kSession, kStart);
    for (std::uint32_t ordinal = 0; ordinal < plan.datagrams(); ++ordinal) {
        const Datagram datagram = security.secure(plan.datagram(0, ordinal, {}), 0);
        CHECK(datagram.size() <= protocol::kMinDatagramBytes);
        const auto clear = opened(datagram, keys(true, true));
        REQUIRE(clear);
        CHECK(protocol::parse_datagram(*clear));
    }
    CHECK(plan.object().description.name == name);
    CHECK(security.count() == plan.datagrams());
}
