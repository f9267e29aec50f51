// tests/receiver/session_test.cpp
#include "receiver/session.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <utility>

#include "common/random.hpp"
#include "sender/datagram_security.hpp"
#include "tests/support/datagrams.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;
using tests::Datagram;
using tests::made_datagrams;
using tests::made_sphere;
using tests::MadeObject;
using tests::MadeStream;

namespace {

Source source_at(std::uint8_t host, std::uint16_t port = 4000) {
    Source source;
    source.address[15] = host;
    source.port = port;
    return source;
}

MadeStream stream_of(std::uint32_t rounds, std::uint8_t session = 1) {
    MadeStream stream;
    stream.session[0] = session;
    stream.rounds = rounds;
    return stream;
}

// A session and its clock; every datagram takes a millisecond.
struct Run {
    explicit Run(const SessionOptions& options = {}) : session(options, 0s) {}

    void receive(const Datagram& datagram, const Source& source = source_at(1)) {
        session.on_datagram(now, source, datagram);
        pass(1ms);
    }
    void receive(const std::vector<Datagram>& datagrams, const Source& source = source_at(1)) {
        for (const Datagram& datagram : datagrams) receive(datagram, source);
    }
    // Wakes the session whenever it wants to be woken.
    void pass(Time duration) {
        const Time until = now + duration;
        for (auto next = session.next_wakeup(); next && *next <= until;
             next = session.next_wakeup()) {
            REQUIRE(*next >= now);
            now = *next;
            session.poll(now);
            if (session.finished() && !ended_at) ended_at = now;
        }
        now = until;
    }
    [[nodiscard]] std::size_t records() const {
        return session.store().shown() ? session.store().shown()->records() : 0;
    }

    Session session;
    Time now = 1s;
    std::optional<Time> ended_at;
};

std::vector<Datagram> without(std::vector<Datagram> datagrams, std::size_t index) {
    datagrams.erase(datagrams.begin() + static_cast<std::ptrdiff_t>(index));
    return datagrams;
}

std::vector<Datagram> slice(const std::vector<Datagram>& all, std::size_t from, std::size_t to) {
    return {all.begin() + static_cast<std::ptrdiff_t>(from),
            all.begin() + static_cast<std::ptrdiff_t>(to)};
}

SessionOptions until(Until rule) {
    SessionOptions options;
    options.until = rule;
    return options;
}

const MadeObject& object() {
    static const MadeObject made = made_sphere(2000, 25);
    return made;
}

}  // namespace

TEST_CASE("a complete object ends reception at once") {
    const Until rule = GENERATE(Until::end, Until::complete, Until::round);
    Run run(until(rule));
    const auto datagrams = made_datagrams(object());
    run.receive(slice(datagrams, 0, datagrams.size() - 1));
    CHECK_FALSE(run.session.finished());
    run.session.on_datagram(run.now, source_at(1), datagrams.back());
    CHECK(run.session.ends_by() == EndReason::complete);
    CHECK(id_matches(*run.session.store().snapshot()));
}

TEST_CASE("the stream's end is waited for 250 ms, and what comes in that time counts") {
    const auto datagrams = made_datagrams(object());
    Run run;
    run.receive(without(datagrams, 3));
    const Time last = run.now - 1ms;
    SECTION("then it is over") {
        run.pass(5s);
        CHECK(run.session.ends_by() == EndReason::stream_end);
        CHECK(run.ended_at == last + 250ms);
        CHECK(run.session.summary(run.now).datagrams.lost == 1);
    }
    SECTION("a late datagram still completes it") {
        run.pass(200ms);
        run.receive(datagrams[3]);
        CHECK(run.session.ends_by() == EndReason::complete);
        CHECK(run.session.summary(run.now).datagrams.lost == 0);
        CHECK(run.session.summary(run.now).datagrams.reordered == 1);
    }
}

TEST_CASE("a silence shorter than the wait for the stream's end comes first") {
    SessionOptions options;
    options.idle_timeout = 100ms;
    Run run(options);
    run.receive(without(made_datagrams(object()), 3));
    run.pass(1s);
    CHECK(run.session.ends_by() == EndReason::idle);
}

TEST_CASE("without the last datagram the silence ends reception, and the tail counts as lost") {
    const auto datagrams = made_datagrams(object());
    SessionOptions options;
    options.idle_timeout = 700ms;
    Run run(options);
    run.receive(slice(datagrams, 0, datagrams.size() - 4));
    const Time last = run.now - 1ms;
    run.pass(5s);
    CHECK(run.session.ends_by() == EndReason::idle);
    CHECK(run.ended_at == last + 700ms);
    CHECK(run.session.summary(run.now).datagrams.lost == 4);
}

TEST_CASE("the end of a middle round ends nothing, the end of the last one does") {
    Run run;
    const auto datagrams = made_datagrams(object(), stream_of(3));
    const std::size_t round = datagrams.size() / 3;
    for (std::size_t k = 0; k < 3; ++k) {
        CHECK_FALSE(run.session.finished());
        auto part = slice(datagrams, k * round, (k + 1) * round);
        run.receive(without(std::move(part), 4));
        run.pass(500ms);
    }
    CHECK(run.session.ends_by() == EndReason::stream_end);
}

TEST_CASE("option --until complete outlives the stream's end, and ends by silence") {
    Run run(until(Until::complete));
    run.receive(without(made_datagrams(object()), 3));
    run.pass(2900ms);
    CHECK_FALSE(run.session.finished());
    run.pass(200ms);
    CHECK(run.session.ends_by() == EndReason::idle);
}

TEST_CASE("option --until round ends after a round that was heard from its start") {
    const auto datagrams = made_datagrams(object(), stream_of(0), 4);
    const std::size_t round = datagrams.size() / 4;
    const auto lossy = [&](std::size_t from, std::size_t to) {
        std::vector<Datagram> some;
        for (std::size_t k = from; k < to; ++k) {
            if (k % round != 5) some.push_back(datagrams[k]);  // one is always lost
        }
        return some;
    };
    Run run(until(Until::round));
    SECTION("joined in the middle: the next one") {
        run.receive(lossy(6, round));
        run.pass(400ms);
        run.receive(lossy(round, 2 * round - 1));
        CHECK_FALSE(run.session.finished());
        run.receive(datagrams[2 * round - 1]);
        run.pass(400ms);
        CHECK(run.session.ends_by() == EndReason::round);
    }
    SECTION("joined at the start: this one") {
        run.receive(lossy(round, 2 * round));
        run.pass(400ms);
        CHECK(run.session.ends_by() == EndReason::round);
    }
    SECTION("its last datagram lost: the next round's first says so") {
        run.receive(lossy(0, round - 1));
        run.pass(1s);
        CHECK_FALSE(run.session.finished());
        run.receive(datagrams[round + 1]);
        run.pass(400ms);
        CHECK(run.session.ends_by() == EndReason::round);
    }
    SECTION("the first datagram overtaken: still this one") {
        run.receive(datagrams[1]);
        run.receive(datagrams[0]);
        run.receive(lossy(2, round));
        run.pass(400ms);
        CHECK(run.session.ends_by() == EndReason::round);
    }
}

TEST_CASE("option --until forever ends only by the user, and keeps what was received") {
    Run run(until(Until::forever));
    run.receive(made_datagrams(object()));
    run.pass(10min);
    CHECK_FALSE(run.session.finished());
    CHECK_FALSE(run.session.next_wakeup().has_value());
    run.session.interrupt(run.now);
    CHECK(run.session.ends_by() == EndReason::interrupted);
    CHECK(is_complete(*run.session.store().snapshot()));
}

TEST_CASE("before the first valid datagram nothing ends reception but --wait") {
    SessionOptions options;
    SECTION("without end") {
        Run run(options);
        run.receive({Datagram{}, Datagram(5, 1), Datagram(1200, 0x80)});
        run.pass(1h);
        CHECK_FALSE(run.session.finished());
        CHECK(run.session.summary(run.now).malformed.total() == 3);
        run.session.interrupt(run.now);
        CHECK(run.session.store().shown() == nullptr);
    }
    SECTION("for a while, garbage or not") {
        options.wait = 3s;  // from 0 s on
        Run run(options);
        run.receive(Datagram(1200, 0x80));
        run.pass(10s);
        CHECK(run.session.ends_by() == EndReason::waited);
        CHECK(run.ended_at == 3s);
    }
    SECTION("a datagram in time lifts it") {
        options.wait = 3s;
        Run run(options);
        run.receive(made_datagrams(object())[2]);
        run.pass(2900ms);
        CHECK_FALSE(run.session.finished());
        run.pass(200ms);
        CHECK(run.session.ends_by() == EndReason::idle);
    }
}

TEST_CASE("what arrives after the end changes nothing") {
    const auto datagrams = made_datagrams(object());
    Run run;
    run.receive(slice(datagrams, 0, 5));
    run.session.interrupt(run.now);
    const std::size_t records = run.records();
    run.receive(datagrams);
    CHECK(run.records() == records);
    CHECK(run.session.summary(run.now).datagrams.received == 5);
}

TEST_CASE("rounds are united: what one lost another brings") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u, 4u);
    CAPTURE(seed);
    common::Random random(seed);
    Run run;
    const auto datagrams = made_datagrams(object(), stream_of(3));
    const std::size_t round = datagrams.size() / 3;
    std::vector<bool> seen(round, false);
    std::uint64_t sent = 0;
    for (std::size_t k = 0; k < datagrams.size() && !run.session.finished(); ++k) {
        ++sent;
        if (random.chance(0.5)) {
            run.pass(1ms);
            continue;
        }
        seen[k % round] = true;
        run.receive(datagrams[k]);
    }
    run.pass(5s);
    REQUIRE(run.session.finished());
    const ReceivedObject got = *run.session.store().snapshot();
    CHECK(is_complete(got) == std::all_of(seen.begin(), seen.end(), [](bool b) { return b; }));
    const StreamCounts counts = run.session.summary(run.now).datagrams;
    CHECK(counts.received + counts.lost == sent);
    for (std::size_t k = 0; k < got.vertices.size(); ++k) {
        REQUIRE(got.vertices[k] == object().vertices[got.vertex_index[k]]);
    }
}

TEST_CASE("who joins late has lost nothing but what was lost since") {
    Run run(until(Until::forever));
    run.now = 0s;
    const auto datagrams = made_datagrams(object(), stream_of(0), 4);
    run.receive(slice(datagrams, 30, 50));
    run.pass(4ms);
    run.receive(slice(datagrams, 54, datagrams.size()));
    CHECK(run.session.summary(run.now).datagrams.lost == 4);
    CHECK(is_complete(*run.session.store().snapshot()));
}

TEST_CASE("a restarted sender goes on where the first one fell silent") {
    const auto before = made_datagrams(object(), stream_of(1, 1));
    const auto after = made_datagrams(object(), stream_of(1, 2));
    const std::size_t half = before.size() / 2;
    Run run(until(Until::complete));
    run.receive(slice(before, 0, half + 3));
    run.pass(2900ms);
    for (const Datagram& datagram : slice(after, half, after.size() - 1)) {
        run.receive(datagram, source_at(1, 5000));
        run.pass(300ms);
    }
    SECTION("reception does not end over the older one's silence, and the rest completes it") {
        REQUIRE_FALSE(run.session.finished());
        run.receive(after.back(), source_at(1, 5000));
        CHECK(run.session.ends_by() == EndReason::complete);
        CHECK(id_matches(*run.session.store().snapshot()));
    }
    SECTION("the counts of both are summed") {
        run.pass(5s);
        CHECK(run.session.ends_by() == EndReason::idle);
        const auto counts = run.session.summary(run.now).datagrams;
        CHECK(counts.received == half + 3 + (after.size() - 1 - half));
    }
}

TEST_CASE("two hosts that drew the same SSRC are two streams, datagram by datagram") {
    MadeStream ours = stream_of(1);
    MadeStream theirs = stream_of(1, 2);
    theirs.ssrc = ours.ssrc;
    theirs.first_sequence = static_cast<std::uint16_t>(ours.first_sequence + 20'000);
    const auto one = without(made_datagrams(object(), ours), 5);
    const auto two = made_datagrams(made_sphere(300, 3, 9), theirs);
    Run run;
    for (std::size_t k = 0; k < one.size(); ++k) {
        run.receive(one[k], source_at(1));
        if (k < two.size()) run.receive(two[k], source_at(2));
    }
    run.pass(5s);
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.datagrams.received == one.size());
    CHECK(summary.datagrams.lost == 1);
    CHECK(summary.datagrams.reordered == 0);
    CHECK(summary.datagrams.duplicate == 0);
    CHECK(summary.other_datagrams == two.size());
    CHECK(run.session.store().shown()->object == object().id);
}

TEST_CASE("a sender that starts anew has lost nothing, whatever its SSRC and numbers do") {
    MadeStream before = stream_of(0, 1);
    MadeStream after = stream_of(0, 2);
    before.ssrc = 7;
    after.ssrc = GENERATE(7u, 8u);
    // The next number; the same ones again; a jump back, and one of half the numbers.
    const int jump = GENERATE(-40, 0, -1000, 32'768);
    const auto first = made_datagrams(object(), before);
    const std::size_t half = first.size() / 2;
    after.first_sequence =
        static_cast<std::uint16_t>(before.first_sequence + half + static_cast<unsigned>(jump));
    const auto second = made_datagrams(object(), after);
    Run run(until(Until::forever));
    run.receive(slice(first, 0, half));
    run.pass(6s);
    run.receive(without(second, 3));
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.datagrams.received == half + second.size() - 1);
    CHECK(summary.datagrams.lost == 1);
    CHECK(summary.datagrams.duplicate == 0);
    CHECK(summary.datagrams.reordered == 0);
    CHECK(is_complete(*run.session.store().snapshot()));
}

TEST_CASE("another host's traffic neither keeps reception going nor joins the object") {
    const auto datagrams = made_datagrams(object());
    const auto strange = made_datagrams(made_sphere(100, 3, 9), stream_of(0, 7), 100);
    MadeObject other_hint = object();
    other_hint.hint.components = 3;
    Run run;
    run.receive(without(slice(datagrams, 0, datagrams.size() - 1), 2));
    const Time last = run.now - 1ms;
    run.receive(made_datagrams(other_hint)[1], source_at(3));
    for (const Datagram& datagram : strange) {
        run.receive(datagram, source_at(2));
        run.pass(40ms);
    }
    CHECK(run.session.ends_by() == EndReason::idle);
    CHECK(run.ended_at == last + 3s);
    CHECK(run.session.store().shown()->object == object().id);
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.other_groups == 2);
    CHECK(summary.contradictory_hints == 1);
    CHECK(summary.other_datagrams > 50);
    CHECK(summary.datagrams.received == datagrams.size() - 2);
}

TEST_CASE("the snapshot is a function of the set of datagrams") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u);
    CAPTURE(seed);
    common::Random random(seed);
    std::vector<Datagram> subset;
    for (const Datagram& datagram : made_datagrams(object(), stream_of(2))) {
        if (random.chance(0.4)) subset.push_back(datagram);
    }
    Run plain(until(Until::forever));
    plain.receive(subset);
    const std::size_t distinct = subset.size();
    for (std::size_t k = 0; k < distinct; ++k) {
        if (random.chance(0.3)) subset.push_back(subset[k]);
        if (random.chance(0.1)) {
            Datagram damaged = subset[k];
            damaged[random.below(damaged.size())] ^= 0x10;
            subset.push_back(damaged);
        }
    }
    common::shuffle(subset, random);
    Run jumbled(until(Until::forever));
    jumbled.receive(subset);
    const ReceivedObject a = *plain.session.store().snapshot();
    const ReceivedObject b = *jumbled.session.store().snapshot();
    CHECK(a.vertex_index == b.vertex_index);
    CHECK(a.vertices == b.vertices);
    CHECK(a.ellipsoid_index == b.ellipsoid_index);
    CHECK(a.ellipsoids == b.ellipsoids);
    CHECK(a.description == b.description);
}

TEST_CASE("loss simulated at the receiver shows as honest gaps") {
    SessionOptions options;
    options.loss.drop = 0.4;
    options.loss.seed = GENERATE(1u, 2u, 3u);
    Run run(options);
    const auto datagrams = made_datagrams(object(), stream_of(2));
    run.receive(datagrams);
    run.pass(5s);
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.datagrams.received + summary.datagrams.lost == datagrams.size());
    CHECK(summary.datagrams.lost > datagrams.size() / 5);
    CHECK(summary.malformed.total() == 0);
}

TEST_CASE("dropping one kind of section leaves the other whole") {
    SessionOptions options;
    SECTION("no ellipsoids") {
        options.loss.drop_ellipsoids = 1.0;
        Run run(options);
        run.receive(made_datagrams(object()));
        run.pass(5s);
        const ReceivedObject got = *run.session.store().snapshot();
        CHECK(got.ellipsoids.empty());
        CHECK(got.vertices == object().vertices);
        CHECK(got.description == object().description);
    }
    SECTION("no vertices: a datagram left empty is lost whole") {
        options.loss.drop_vertices = 1.0;
        MadeStream stream = stream_of(1);
        stream.describe = false;
        const auto datagrams = made_datagrams(object(), stream);
        Run run(options);
        run.receive(datagrams);
        run.pass(5s);
        const ReceivedObject got = *run.session.store().snapshot();
        CHECK(got.ellipsoids == object().ellipsoids);
        CHECK(got.vertices.empty());
        const StreamCounts counts = run.session.summary(run.now).datagrams;
        CHECK(counts.received + counts.lost == datagrams.size());
    }
}

TEST_CASE("what simulated reordering holds back at the end is not lost") {
    SessionOptions options;
    options.loss.reorder = 1.0;
    Run run(options);
    run.receive(made_datagrams(object()));
    run.pass(5s);
    CHECK(run.session.ends_by() == EndReason::complete);
    CHECK(id_matches(*run.session.store().snapshot()));
}

TEST_CASE("simulated corruption is counted as malformed and enters nothing") {
    SessionOptions options;
    options.loss.corrupt = 0.5;
    options.loss.duplicate = 0.2;
    Run run(options);
    const auto datagrams = made_datagrams(object());
    run.receive(datagrams);
    run.pass(5s);
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.malformed.total() > 0);
    CHECK(summary.datagrams.duplicate > 0);
    const ReceivedObject got = *run.session.store().snapshot();
    for (std::size_t k = 0; k < got.vertices.size(); ++k) {
        REQUIRE(got.vertices[k] == object().vertices[got.vertex_index[k]]);
    }
}

namespace {

std::vector<Datagram> signed_datagrams(std::uint64_t start_us = 1) {
    sender::StreamKeys keys;
    keys.sign = common::SigningKey::of_seed({3});
    sender::DatagramSecurity security(keys, stream_of(1).session, start_us);
    std::vector<Datagram> datagrams;
    for (const Datagram& clear : made_datagrams(object(), stream_of(1))) {
        datagrams.push_back(security.secure(clear, 0));
    }
    return datagrams;
}

SessionOptions verifying() {
    SessionOptions options;
    options.gate.verify = {common::SigningKey::of_seed({3}).public_key()};
    return options;
}

}  // namespace

TEST_CASE("signed datagrams count once they are verified, which is due at once") {
    Run run(verifying());
    for (const Datagram& datagram : signed_datagrams()) {
        run.session.on_datagram(run.now, source_at(1), datagram);
    }
    CHECK(run.records() == 0);
    CHECK(run.session.next_wakeup() == run.now);
    run.pass(1ms);
    CHECK(run.session.ends_by() == EndReason::complete);
    CHECK(id_matches(*run.session.store().snapshot()));
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.authenticity.verified());
    CHECK(summary.datagrams.lost == 0);
    std::uint64_t bytes = 0;
    for (const Datagram& datagram : signed_datagrams()) bytes += datagram.size();
    CHECK(summary.datagrams.bytes == bytes);  // as they came, not as they were let in
}

TEST_CASE("a wish to end waits for what has arrived") {
    Run run(verifying());
    for (const Datagram& datagram : signed_datagrams()) {
        run.session.on_datagram(run.now, source_at(1), datagram);
    }
    run.session.interrupt(run.now);
    CHECK(run.session.ends_by() == EndReason::complete);
}

TEST_CASE("forgers with the right session id are refused and do not keep a session awake") {
    Run run(verifying());
    run.receive(slice(signed_datagrams(), 0, 5));
    const std::size_t records = run.records();
    CHECK(records > 0);
    auto forged = signed_datagrams();
    for (Datagram& datagram : forged) datagram[datagram.size() - 200] ^= 1;
    run.receive(forged);
    run.receive(made_datagrams(object(), stream_of(1)));
    CHECK(run.records() == records);
    CHECK(run.session.store().groups().size() == 1);
    const SessionSummary summary = run.session.summary(run.now);
    CHECK(summary.refused[static_cast<std::size_t>(Refusal::bad_signature)] == forged.size());
    CHECK(summary.refused[static_cast<std::size_t>(Refusal::not_signed)] == forged.size());
    CHECK(summary.malformed.total() == 0);
    for (int k = 0; k < 30 && !run.session.finished(); ++k) {
        run.receive(forged[0]);
        run.pass(100ms);
    }
    CHECK(run.session.ends_by() == EndReason::idle);
}

TEST_CASE("loss is simulated on what the gate lets in, sections of signed datagrams included") {
    SessionOptions options = verifying();
    options.loss.drop_vertices = 1.0;
    Run run(options);
    run.receive(signed_datagrams());
    REQUIRE(run.session.store().shown());
    CHECK(run.session.store().shown()->vertices.size() == 0);
    CHECK(run.session.store().shown()->ellipsoids.size() > 0);
}

TEST_CASE("a clock that is set by hours, either way, neither ends reception nor holds it up") {
    constexpr std::chrono::microseconds kStart = 1'700'000'000s;
    const auto step = GENERATE(-9000h, -3h, 3h, 9000h);
    const auto datagrams = signed_datagrams(static_cast<std::uint64_t>(kStart.count()));
    const std::size_t third = datagrams.size() / 3;
    SessionOptions options = verifying();
    const auto clock = [&](Run& run, std::chrono::microseconds ahead) {
        run.session.set_clock(run.now, kStart + ahead);
    };
    SECTION("nobody asked for an age") {
        Run run(options);
        clock(run, 0s);
        run.receive(slice(datagrams, 0, third));
        clock(run, step);
        run.receive(slice(datagrams, third, datagrams.size()));
        CHECK(run.session.ends_by() == EndReason::complete);
    }
    options.gate.max_age = 10s;
    SECTION("an age is asked for: taken again as soon as the clock is right again") {
        Run run(options);
        clock(run, 0s);
        run.receive(slice(datagrams, 0, third));
        const std::size_t records = run.records();
        REQUIRE(records > 0);
        clock(run, step);
        run.receive(slice(datagrams, third, 2 * third));
        CHECK(run.records() == records);
        CHECK_FALSE(run.session.finished());
        clock(run, 0s);
        run.receive(slice(datagrams, 2 * third, datagrams.size()));
        CHECK(run.records() > records);
        run.receive(slice(datagrams, third, 2 * third));  // in the next round, say
        CHECK(run.session.ends_by() == EndReason::complete);
        CHECK(id_matches(*run.session.store().snapshot()));
    }
    SECTION("an age is asked for, and the clock stays wrong: what was received is kept") {
        Run run(options);
        clock(run, 0s);
        run.receive(slice(datagrams, 0, third));
        const std::size_t records = run.records();
        clock(run, step);
        for (int k = 0; k < 30 && !run.session.finished(); ++k) {
            run.receive(datagrams[third]);
            run.pass(100ms);
        }
        CHECK(run.session.ends_by() == EndReason::idle);
        CHECK(run.records() == records);
        CHECK(
            run.session.summary(run.now).refused[static_cast<std::size_t>(Refusal::out_of_date)] >=
            10);
    }
}
