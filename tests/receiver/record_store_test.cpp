// tests/receiver/record_store_test.cpp
#include "receiver/record_store.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>

#include "common/random.hpp"
#include "tests/support/datagrams.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;
using tests::Datagram;
using tests::made_datagram;
using tests::made_datagrams;
using tests::made_header;
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

bool offer(RecordStore& store, const Datagram& bytes, Time now = 0s,
           const Source& source = source_at(1)) {
    const auto view = protocol::parse_datagram(bytes);
    REQUIRE(view.has_value());
    return store.accept(now, {source, view->header.session}, *view);
}

void offer_all(RecordStore& store, const std::vector<Datagram>& datagrams, Time now = 0s,
               const Source& source = source_at(1)) {
    for (const Datagram& datagram : datagrams) offer(store, datagram, now, source);
}

bool same(const ReceivedObject& a, const ReceivedObject& b) {
    return a.id == b.id && a.hint == b.hint && a.description == b.description &&
           a.ellipsoid_index == b.ellipsoid_index && a.ellipsoids == b.ellipsoids &&
           a.vertex_index == b.vertex_index && a.vertices == b.vertices && a.edges == b.edges;
}

std::vector<protocol::VertexRecord> vertex_at(float x, float y, float z) {
    return {{{x, y, z}}};
}

MadeStream session_of(std::uint8_t number) {
    MadeStream stream;
    stream.session = {number, 0, 0, 0, 0, 0, 0, number};
    return stream;
}

}  // namespace

TEST_CASE("a whole round gives the object that was sent, and its id holds") {
    const MadeObject sent = made_sphere(3000, 40);
    RecordStore store;
    CHECK_FALSE(store.snapshot().has_value());
    offer_all(store, made_datagrams(sent));

    const ReceivedObject got = store.snapshot().value();
    CHECK(got.id == sent.id);
    CHECK(got.hint == sent.hint);
    CHECK(got.description == sent.description);
    CHECK(got.ellipsoids == sent.ellipsoids);
    CHECK(got.vertices == sent.vertices);
    CHECK(is_complete(got));
    CHECK(id_matches(got));
    CHECK(store.shown()->complete());
}

TEST_CASE("edges are kept, united with a restarted sender's, and complete nothing") {
    const MadeObject sent = made_sphere(300, 4);
    const auto edges_of = [&](std::uint8_t session, std::vector<protocol::EdgeRecord> edges) {
        protocol::DatagramWriter writer(made_header(sent, session_of(session)), 1200);
        writer.add_edges(edges);
        return writer.finish();
    };
    RecordStore store;
    offer(store, edges_of(1, {{300, 5, 7}, {300, 1, 299}}));
    offer(store, edges_of(1, {{150, 3, 4}, {150, 3, 5}}));
    offer(store, edges_of(1, {{300, 5, 7}}));
    CHECK_FALSE(store.shown()->complete());
    CHECK(store.shown()->records() == 0);
    const std::vector<protocol::EdgeRecord> first{
        {150, 3, 4}, {150, 3, 5}, {300, 1, 299}, {300, 5, 7}};
    CHECK(store.snapshot()->edges == first);
    const std::size_t bytes = store.bytes();
    CHECK(bytes > 0);
    offer(store, edges_of(2, {{300, 0, 1}}), 6s);
    REQUIRE(store.groups().size() == 1);
    CHECK(store.snapshot()->edges.size() == 5);
    CHECK(store.snapshot()->edges.front() == first.front());
    CHECK(store.bytes() > bytes);
}

TEST_CASE("a complete object whose records are not those of its id is seen through") {
    MadeObject lie = made_sphere(300, 4);
    lie.vertices[7].position[0] *= 0.5f;
    RecordStore store;
    offer_all(store, made_datagrams(lie));
    CHECK(is_complete(*store.snapshot()));
    CHECK_FALSE(id_matches(*store.snapshot()));
}

TEST_CASE("order, copies and interleaved strangers leave the snapshot as it is") {
    const MadeObject sent = made_sphere(2000, 30);
    const MadeObject stranger = made_sphere(1200, 10, 77);
    const std::uint64_t seed = GENERATE(1u, 2u, 3u, 4u, 5u, 6u);
    CAPTURE(seed);
    common::Random random(seed);

    std::vector<Datagram> subset;
    for (const Datagram& datagram : made_datagrams(sent)) {
        if (random.chance(0.7)) subset.push_back(datagram);
    }
    RecordStore plain;
    offer_all(plain, subset);

    std::vector<std::pair<Datagram, Source>> mixed;
    for (const Datagram& datagram : subset) {
        const std::size_t copies = 1 + random.below(3);
        for (std::size_t k = 0; k < copies; ++k) mixed.emplace_back(datagram, source_at(1));
    }
    for (const Datagram& datagram : made_datagrams(stranger, session_of(9))) {
        if (random.chance(0.5)) mixed.emplace_back(datagram, source_at(2));
    }
    common::shuffle(mixed, random);
    RecordStore jumbled;
    for (const auto& [datagram, source] : mixed) offer(jumbled, datagram, 0s, source);
    CHECK(same(*jumbled.snapshot(), *plain.snapshot()));
    CHECK(jumbled.groups().size() == 2);
}

TEST_CASE("of conflicting records the same one stays whatever came first") {
    const MadeObject sent = made_sphere(5000, 2);  // sparse for long
    const auto header = made_header(sent);
    const std::uint64_t seed = GENERATE(1u, 2u, 3u);
    CAPTURE(seed);
    common::Random random(seed);
    // A few indices, each with several contents, each content several times.
    std::vector<Datagram> datagrams = made_datagrams(sent);
    if (seed != 1) datagrams.clear();  // once dense, else sparse
    for (std::uint32_t index = 10; index < 20; ++index) {
        for (int k = 0; k < 4; ++k) {
            const auto v = static_cast<float>(0.1 * static_cast<double>(random.below(5)) - 0.2);
            datagrams.push_back(made_datagram(header, index, vertex_at(v, 0.5f, -v)));
        }
    }
    std::optional<ReceivedObject> first;
    std::size_t first_conflicts = 0;
    for (int trial = 0; trial < 6; ++trial) {
        common::shuffle(datagrams, random);
        RecordStore store;
        offer_all(store, datagrams);
        if (!first) {
            first = store.snapshot();
            first_conflicts = store.shown()->vertices.conflicting();
            CHECK(first_conflicts > 0);
        }
        CHECK(same(*store.snapshot(), *first));
        CHECK(store.shown()->vertices.conflicting() == first_conflicts);
    }
}

TEST_CASE("tags arrive with their vertices, in every format, and the id holds") {
    for (std::uint8_t code = 0; code < 16; ++code) {
        CAPTURE(int{code});
        MadeObject object = made_sphere(300, 10);
        add_tags(object, protocol::RecordFormat::of_code(code));
        RecordStore store;
        offer_all(store, made_datagrams(object));
        const auto snapshot = store.snapshot();
        REQUIRE(snapshot.has_value());
        CHECK(snapshot->vertices == object.vertices);
        CHECK(id_matches(*snapshot));
        if (code == 0) continue;
        add_tags(object, protocol::RecordFormat::of_code(code), 2);
        CHECK(object.id != snapshot->id);
    }
}

TEST_CASE("of records that differ in a tag alone the one with the smaller bytes stays") {
    MadeObject object = made_sphere(300, 10);
    add_tags(object, {.normal_bits = 16, .ring = true, .colour = true});
    // In the order of the canonical form: normal, ring, red, green, blue; the first one decides.
    const std::vector<protocol::VertexRecord> ascending{
        {{0, 0, 1}, 0x00ff, 0xff, {9, 9, 9}}, {{0, 0, 1}, 0x0100, 0x7f, {9, 9, 9}},
        {{0, 0, 1}, 0x0100, 0x80, {0, 9, 9}}, {{0, 0, 1}, 0x0100, 0x80, {1, 8, 9}},
        {{0, 0, 1}, 0x0100, 0x80, {1, 9, 8}}, {{0, 0, 1}, 0x0100, 0x80, {1, 9, 9}}};
    for (std::size_t a = 0; a < ascending.size(); ++a) {
        for (std::size_t b = 0; b < ascending.size(); ++b) {
            CAPTURE(a, b);
            RecordStore store;
            offer(store, made_datagram(made_header(object), 7, std::vector{ascending[a]}));
            offer(store, made_datagram(made_header(object), 7, std::vector{ascending[b]}));
            REQUIRE(store.snapshot()->vertices.size() == 1);
            CHECK(store.snapshot()->vertices[0] == ascending[std::min(a, b)]);
            CHECK(store.shown()->vertices.conflicting() == (a == b ? 0 : 1));
        }
    }
}

TEST_CASE("zero and minus zero are different records") {
    const MadeObject sent = made_sphere(100, 2);
    const auto header = made_header(sent);
    for (const bool swap : {false, true}) {
        RecordStore store;
        offer(store, made_datagram(header, 3, vertex_at(swap ? 0.f : -0.f, 0, 0)));
        offer(store, made_datagram(header, 3, vertex_at(swap ? -0.f : 0.f, 0, 0)));
        CHECK(store.shown()->vertices.conflicting() == 1);
        CHECK_FALSE(std::signbit(store.snapshot()->vertices[0].position[0]));
    }
}

TEST_CASE("of contradictory descriptions the same one stays whatever came first") {
    const MadeObject sent = made_sphere(100, 2);
    const auto header = made_header(sent);
    protocol::Description other = sent.description;
    other.origin = {1, 2, 3};
    std::vector<Datagram> datagrams{made_datagram(header, sent.description),
                                    made_datagram(header, other)};
    RecordStore a;
    offer_all(a, datagrams);
    std::reverse(datagrams.begin(), datagrams.end());
    RecordStore b;
    offer_all(b, datagrams);
    CHECK(a.snapshot()->description == b.snapshot()->description);
}

TEST_CASE("contradictory hints, other sessions and other addresses never mix") {
    const MadeObject sent = made_sphere(600, 6);
    MadeObject other_hint = sent;  // same id, which is then a lie
    other_hint.hint.components = 2;
    RecordStore store;
    const auto datagrams = made_datagrams(sent);
    offer(store, datagrams[0]);
    offer(store, made_datagrams(other_hint)[1]);
    offer(store, made_datagrams(sent, session_of(2))[2]);
    offer(store, datagrams[3], 0s, source_at(2));
    offer(store, datagrams[3], 0s, source_at(1, 4001));
    CHECK(store.groups().size() == 5);
    for (const auto& group : store.groups()) CHECK(group.datagrams == 1);
}

TEST_CASE("the group with the most distinct records is shown, ties do not depend on order") {
    const MadeObject a = made_sphere(600, 6, 1);
    const MadeObject b = made_sphere(600, 6, 2);
    const auto from_a = made_datagrams(a, session_of(1));
    const auto from_b = made_datagrams(b, session_of(2));
    RecordStore forward;
    offer_all(forward, from_a);
    offer_all(forward, from_b);
    RecordStore backward;
    offer_all(backward, from_b);
    offer_all(backward, from_a);
    CHECK(same(*forward.snapshot(), *backward.snapshot()));

    RecordStore uneven;  // copies are no records
    offer(uneven, from_a[1]);
    offer(uneven, from_b[1]);
    offer(uneven, from_b[2]);
    for (int k = 0; k < 5; ++k) offer(uneven, from_a[1]);
    CHECK(uneven.shown()->object == b.id);
}

TEST_CASE("a restarted sender's records join the old ones once those were silent for 5 s") {
    const MadeObject sent = made_sphere(2000, 20);
    const auto before = made_datagrams(sent, session_of(1));
    const auto after = made_datagrams(sent, session_of(2));
    const std::size_t half = before.size() / 2;
    const std::vector<Datagram> first_half(before.begin(), before.begin() + std::ptrdiff_t(half));
    const std::vector<Datagram> second_half(after.begin() + std::ptrdiff_t(half), after.end());

    RecordStore store;
    offer_all(store, first_half, 0s, source_at(1, 4000));
    offer_all(store, second_half, 4999ms, source_at(1, 4001));
    CHECK(store.groups().size() == 2);
    SECTION("when the next datagram comes") {
        offer(store, second_half[0], 5000ms, source_at(1, 4001));
    }
    SECTION("or when somebody looks") {
        store.merge_silent(5000ms);
    }
    SECTION("whichever has more") {
        offer_all(store, {after[0], after[1], after[2], after[3], after[4]}, 5000ms,
                  source_at(1, 4001));
    }
    REQUIRE(store.groups().size() == 1);
    CHECK(store.shown()->complete());
    CHECK(store.shown()->senders.size() == 2);
    CHECK(store.shown()->sender.session == session_of(2).session);
    CHECK(id_matches(*store.snapshot()));
    CHECK(store.counts().merged == 1);
}

TEST_CASE("a sender that restarts twice is united with both of its former selves") {
    const MadeObject sent = made_sphere(600, 6);
    const auto part = [&](std::uint8_t session, std::size_t k) {
        return made_datagrams(sent, session_of(session))[k];
    };
    RecordStore store;
    offer(store, part(1, 1), 0s);
    offer(store, part(2, 2), 1s);
    offer(store, part(4, 3), 1s, source_at(9));  // a stranger, who stays
    offer(store, part(3, 4), 10s);
    offer(store, part(3, 5), 10s);
    REQUIRE(store.groups().size() == 2);
    CHECK(store.shown()->senders.size() == 3);
    CHECK(store.shown()->datagrams == 4);
    CHECK(store.counts().merged == 2);
}

TEST_CASE("another address or another hint is never taken for a restart") {
    const MadeObject sent = made_sphere(600, 6);
    MadeObject other_hint = sent;
    other_hint.hint.approximate = true;
    RecordStore store;
    offer(store, made_datagrams(sent, session_of(1))[0]);
    offer(store, made_datagrams(sent, session_of(2))[1], 10s, source_at(2));
    offer(store, made_datagrams(other_hint, session_of(3))[1], 20s, source_at(1));
    store.merge_silent(60s);
    CHECK(store.groups().size() == 3);
}

TEST_CASE("merging keeps disputes and picks the same record as any order would") {
    const MadeObject sent = made_sphere(3000, 2);
    const auto old_header = made_header(sent, session_of(1));
    const auto new_header = made_header(sent, session_of(2));
    const protocol::VertexRecord low{{0.25f, 0, 0}};
    const protocol::VertexRecord high{{0.5f, 0, 0}};
    for (const bool swap : {false, true}) {
        RecordStore store;
        offer(store, made_datagram(old_header, 5, std::vector{swap ? low : high}));
        offer(store, made_datagram(old_header, 6, std::vector{low}));
        offer(store, made_datagram(old_header, 6, std::vector{high}));
        offer(store, made_datagram(new_header, 5, std::vector{swap ? high : low}), 6s,
              source_at(1, 4001));
        REQUIRE(store.groups().size() == 1);
        CHECK(store.shown()->vertices.conflicting() == 2);
        CHECK(store.snapshot()->vertices == std::vector{low, low});
    }
}

TEST_CASE("a flood of groups neither grows without bound nor washes the real one away") {
    const MadeObject sent = made_sphere(2000, 20);
    const auto datagrams = made_datagrams(sent, session_of(1));
    const Datagram pattern = made_datagrams(made_sphere(100, 2, 5), session_of(2)).back();
    common::Random random(11);
    StoreLimits limits;
    limits.groups = 16;
    RecordStore store(limits);
    std::size_t next = 0;
    for (int k = 0; k < 4000; ++k) {
        auto view = protocol::parse_datagram(pattern);
        view->header.object[0] = static_cast<std::uint8_t>(random.next());
        view->header.session[3] = static_cast<std::uint8_t>(random.next());
        store.accept(Time(k), {source_at(static_cast<std::uint8_t>(random.below(250) + 2))}, *view);
        if (k % 5 == 0 && next < datagrams.size()) offer(store, datagrams[next++], Time(k));
        REQUIRE(store.groups().size() <= limits.groups);
    }
    CHECK(store.counts().evicted > 3000);
    CHECK(store.shown()->object == sent.id);
    CHECK(store.shown()->complete());
    CHECK(store.bytes() < 200'000);
}

TEST_CASE("memory follows what arrived, not what a hint claims") {
    MadeObject claim = made_sphere(91, 2);
    claim.hint.vertices = 1u << 25;
    protocol::DatagramHeader header = made_header(claim);
    RecordStore store;
    std::size_t arrived = 0;
    for (std::uint32_t k = 0; k < 50; ++k) {
        offer(store, made_datagram(header, k * 600'000u, claim.vertices));
        arrived += claim.vertices.size();
        CHECK(store.bytes() <= arrived * 16 * sizeof(protocol::VertexRecord));
    }
    CHECK(store.snapshot()->vertices.size() == arrived);
}

TEST_CASE("an object of as many vertices as are allowed fits into the bytes that are") {
    const StoreLimits defaults;
    MadeObject claim = made_sphere(1 << 10, 2);
    claim.hint.vertices = 1u << 15;
    StoreLimits limits;  // the same ratio, a thousandth of the size
    limits.vertices = claim.hint.vertices;
    limits.bytes = defaults.bytes / (defaults.vertices / limits.vertices);
    RecordStore store(limits);
    for (std::uint32_t k = 0; k < claim.hint.vertices; k += 1 << 10) {
        offer(store, made_datagram(made_header(claim), k, claim.vertices));
    }
    CHECK(store.counts().refused == 0);
    CHECK(store.shown()->vertices.complete());
}

TEST_CASE("the limit of bytes refuses records, loses none, and leaves room for others") {
    MadeObject claim = made_sphere(1000, 2);
    claim.hint.vertices = 1u << 24;
    StoreLimits limits;
    limits.bytes = 400'000;
    RecordStore store(limits);
    for (std::uint32_t k = 0; k < 16; ++k) {
        offer(store, made_datagram(made_header(claim), k * 1000, claim.vertices), 0s, source_at(9));
    }
    CHECK(store.counts().refused > 0);
    CHECK(store.bytes() <= limits.bytes / 2);
    const std::size_t kept = store.shown()->records();

    const MadeObject honest = made_sphere(700, 5);
    offer_all(store, made_datagrams(honest, session_of(3)));
    CHECK(store.bytes() <= limits.bytes);
    REQUIRE(store.groups().size() == 2);
    CHECK(store.groups()[0].records() == kept);
    CHECK(store.groups()[1].complete());
}

TEST_CASE("an object beyond the limit of vertices is not taken in") {
    const MadeObject sent = made_sphere(600, 6);
    StoreLimits limits;
    limits.vertices = 599;
    RecordStore store(limits);
    CHECK_FALSE(offer(store, made_datagrams(sent)[0]));
    CHECK(store.shown() == nullptr);
    CHECK(store.counts().over_limit == 1);
}

TEST_CASE("a verified key is one sender, wherever it sends from and whenever it started") {
    const MadeObject sent = made_sphere(900, 20);
    const auto first = made_datagrams(sent, session_of(1));
    const auto second = made_datagrams(sent, session_of(2));
    Source verified = source_at(1);
    verified.authenticity.key = {7};
    verified.authenticity.is_signed = true;
    Source elsewhere = source_at(2, 5000);
    elsewhere.authenticity = verified.authenticity;

    RecordStore store;
    offer_all(store, {first.begin(), first.end() - 3}, 0s, verified);
    CHECK_FALSE(store.shown()->complete());
    offer_all(store, {second.end() - 3, second.end()}, 1ms, elsewhere);
    REQUIRE(store.groups().size() == 1);
    CHECK(store.shown()->complete());
    CHECK(store.shown()->sender.session == session_of(2).session);
    CHECK(store.shown()->senders.size() == 2);
    CHECK(store.shown()->progress.stream_end() == 1ms);  // of the later run
    CHECK(id_matches(store.snapshot().value()));
}

TEST_CASE("what a key did not sign, or another key did, never joins what it signed") {
    const MadeObject sent = made_sphere(900, 20);
    const auto datagrams = made_datagrams(sent);
    Source verified = source_at(1);
    verified.authenticity.key = {7};
    verified.authenticity.is_signed = true;
    Source other_key = verified;
    other_key.authenticity.key = {8};
    Source claims = source_at(1);
    claims.authenticity.is_signed = true;
    Source clear = source_at(1);

    RecordStore store;
    Time now = 0s;
    for (const Source& source : {verified, other_key, claims, clear}) {
        offer(store, datagrams[0], now, source);
        now += 10s;  // longer than any silence that unites
    }
    store.merge_silent(now);
    REQUIRE(store.groups().size() == 3);
    CHECK(store.groups()[0].sender.source == verified);
    CHECK(store.groups()[1].sender.source == other_key);
    CHECK_FALSE(store.groups()[2].sender.source.authenticity.verified());
    CHECK(same_station({verified, {1}}, {verified, {2}}));
    CHECK_FALSE(same_station({verified, {}}, {other_key, {}}));
    CHECK_FALSE(same_station({verified, {}}, {clear, {}}));
    CHECK(same_station({source_at(1, 5), {1}}, {source_at(1, 6), {2}}));
    CHECK_FALSE(same_station({source_at(1), {}}, {source_at(2), {}}));
}
