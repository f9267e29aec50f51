// tests/sender/session_test.cpp
#include "sender/session.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "tests/sender/made_objects.hpp"

namespace ellicast::sender {
namespace {

using namespace std::chrono_literals;
using tests::made_object;

struct Sent {
    Time at{};
    Datagram bytes;
    protocol::DatagramHeader header;
    std::size_t ellipsoid_sections = 0;
    std::size_t vertex_sections = 0;
};

Sent sent(Time at, Datagram bytes) {
    Sent result;
    result.at = at;
    const auto view = protocol::parse_datagram(bytes);
    REQUIRE(view.has_value());
    result.header = view->header;
    for (const protocol::SectionView& section : view->sections()) {
        result.ellipsoid_sections += section.kind == protocol::SectionKind::ellipsoids;
        result.vertex_sections += section.kind == protocol::SectionKind::vertices;
    }
    result.bytes = std::move(bytes);
    return result;
}

/// Runs a session under virtual time, waking up when it wants plus up to `late`.
std::vector<Sent> run(Session& session, Time epoch = 0s, Time late = 0s, Time until = 1h) {
    std::vector<Sent> all;
    std::vector<Datagram> out;
    common::Random random(1);
    Time now = epoch;
    while (!session.done() && now < epoch + until) {
        out.clear();
        session.poll(now, out);
        for (Datagram& datagram : out) all.push_back(sent(now, std::move(datagram)));
        if (session.next_wakeup() <= now) continue;  // more is due
        now = session.next_wakeup();
        if (late > 0s)
            now += Time(
                static_cast<std::int64_t>(random.below(static_cast<std::size_t>(late.count()))));
    }
    return all;
}

PlanOptions plan_options(std::uint32_t rounds = 1) {
    PlanOptions options;
    options.rounds = rounds;
    return options;
}

std::vector<RoundPlan> one_plan(std::size_t vertices = 5000, std::uint32_t rounds = 1) {
    return {RoundPlan(made_object(50, vertices), plan_options(rounds))};
}

}  // namespace

TEST_CASE("the rate is exact over every stretch, headers below the payload included") {
    SessionOptions options;
    options.bits_per_second = GENERATE(100'000u, 1'000'000u, 20'000'000u, 1'000'000'000u);
    options.ip_udp_bytes = GENERATE(28u, 48u);
    const Time late = GENERATE(Time(0s), Time(2ms));
    CAPTURE(options.bits_per_second, late.count());
    Session session(one_plan(20'000), options);
    const std::vector<Sent> all = run(session, 77s, late);
    REQUIRE(all.size() == *session.datagrams_in_all());
    double bits = 0;  // of all datagrams but the last: the last one's time shows they are paid
    for (std::size_t k = 0; k + 1 < all.size(); ++k) {
        bits += 8.0 * static_cast<double>(all[k].bytes.size() + options.ip_udp_bytes);
    }
    const double seconds = std::chrono::duration<double>(all.back().at - all.front().at).count();
    const double due = bits / static_cast<double>(options.bits_per_second);
    CHECK(seconds >= due - 0.005);
    CHECK(seconds <= due + 0.002 + 1e-9);
    if (late == 0s) CHECK(seconds == Approx(due).margin(1e-8));
}

TEST_CASE("rounds follow each other, and the session ends after the last") {
    Session session(one_plan(3000, 4), SessionOptions{});
    const std::vector<Sent> all = run(session);
    CHECK(session.done());
    CHECK(session.counts().rounds == 4);
    CHECK(session.counts().offered == all.size());
    std::uint32_t round = 0;
    std::uint32_t ordinal = 0;
    for (const Sent& datagram : all) {
        REQUIRE(datagram.header.round == round);
        REQUIRE(datagram.header.ordinal == ordinal);
        REQUIRE(datagram.header.rounds == 4);
        REQUIRE(datagram.header.rtp.marker == (ordinal + 1 == datagram.header.datagrams));
        if (++ordinal == datagram.header.datagrams) ordinal = 0, ++round;
    }
    CHECK(round == 4);
    std::vector<Datagram> more;
    session.poll(2h, more);
    CHECK(more.empty());
}

TEST_CASE("datagrams made in the memory of earlier ones are the same") {
    const auto bytes_of = [](bool recycles) {
        Session session(one_plan(3000, 2), SessionOptions{});
        std::vector<Datagram> all;
        std::vector<Datagram> batch;
        for (Time now = 0s; !session.done(); now = std::max(now, session.next_wakeup())) {
            session.poll(now, batch);
            all.insert(all.end(), batch.begin(), batch.end());
            if (recycles) session.recycle(batch);
            batch.clear();
        }
        return all;
    };
    CHECK(bytes_of(true) == bytes_of(false));
}

TEST_CASE("a session without end goes on") {
    Session session(one_plan(500, 0), SessionOptions{});
    const std::vector<Sent> all = run(session, 0s, 0s, 2s);
    CHECK_FALSE(session.done());
    CHECK_FALSE(session.datagrams_in_all().has_value());
    CHECK(session.counts().rounds > 100);
    CHECK(all.back().header.round == session.counts().rounds);
}

TEST_CASE("several objects take turns in every round, as one stream") {
    std::vector<RoundPlan> plans;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        plans.emplace_back(made_object(20, 1000 * seed, seed), plan_options(2));
    }
    std::vector<protocol::ObjectId> ids;
    ids.reserve(plans.size());
    for (const RoundPlan& plan : plans) ids.push_back(plan.object().id);
    Session session(plans, SessionOptions{});
    const std::vector<Sent> all = run(session);
    std::vector<std::pair<std::uint32_t, protocol::ObjectId>> turns;
    for (std::size_t k = 0; k < all.size(); ++k) {
        REQUIRE(all[k].header.rtp.sequence == static_cast<std::uint16_t>(k));
        const std::pair turn{all[k].header.round, all[k].header.object};
        if (turns.empty() || turns.back() != turn) turns.push_back(turn);
    }
    REQUIRE(turns.size() == 6);
    for (std::size_t k = 0; k < 6; ++k)
        CHECK(turns[k] == std::pair(std::uint32_t(k / 3), ids[k % 3]));
}

TEST_CASE("sequence numbers and timestamps wrap around and tell the truth") {
    SessionOptions options;
    options.first_sequence = 65'500;
    options.first_timestamp = 0xffffff00u;
    options.ssrc = 0xdeadbeefu;
    options.bits_per_second = 5'000'000;
    Session session(one_plan(30'000), options);
    const Time epoch = 123'456'789us;
    const std::vector<Sent> all = run(session, epoch);
    REQUIRE(all.size() > 100);
    for (std::size_t k = 0; k < all.size(); ++k) {
        const protocol::RtpHeader& rtp = all[k].header.rtp;
        REQUIRE(rtp.sequence == static_cast<std::uint16_t>(65'500 + k));
        REQUIRE(rtp.ssrc == 0xdeadbeefu);
        const auto ticks =
            static_cast<double>(static_cast<std::uint32_t>(rtp.timestamp - 0xffffff00u));
        const double seconds = std::chrono::duration<double>(all[k].at - epoch).count();
        REQUIRE(std::abs(ticks - 90'000.0 * seconds) <= 1.0);
    }
}

TEST_CASE("simulated loss acts after numbering: gaps are honest and the pace is kept") {
    SessionOptions options;
    Session clean(one_plan(20'000), options);
    const std::vector<Sent> whole = run(clean);
    options.impairment.drop = 0.3;
    options.impairment.seed = 5;
    Session lossy(one_plan(20'000), options);
    const std::vector<Sent> rest = run(lossy);
    CHECK(lossy.counts().offered == whole.size());
    CHECK(lossy.counts().dropped == whole.size() - rest.size());
    const double share = static_cast<double>(rest.size()) / static_cast<double>(whole.size());
    CHECK(share == Approx(0.7).margin(0.1));
    for (const Sent& datagram : rest) {
        const Sent& original = whole[datagram.header.rtp.sequence];
        REQUIRE(datagram.bytes == original.bytes);
        REQUIRE(datagram.at == original.at);
    }
}

TEST_CASE("losing sections of one kind leaves the other kind, and drops what is left empty") {
    SessionOptions options;
    options.impairment.drop_vertices = 1.0;
    Session session(one_plan(20'000), options);
    const std::vector<Sent> rest = run(session);
    REQUIRE_FALSE(rest.empty());
    std::size_t ellipsoid_sections = 0;
    for (const Sent& datagram : rest) {
        REQUIRE(datagram.vertex_sections == 0);
        ellipsoid_sections += datagram.ellipsoid_sections;
    }
    CHECK(session.counts().dropped + rest.size() == session.counts().offered);
    Session clean(one_plan(20'000), SessionOptions{});
    std::size_t all_sections = 0;
    for (const Sent& datagram : run(clean)) all_sections += datagram.ellipsoid_sections;
    CHECK(ellipsoid_sections == all_sections);

    options.impairment.drop_vertices = 0.0;
    options.impairment.drop_ellipsoids = 0.5;
    Session half(one_plan(20'000), options);
    std::size_t kept = 0;
    for (const Sent& datagram : run(half)) kept += datagram.ellipsoid_sections;
    CHECK(kept > 0);
    CHECK(kept < all_sections);
}

TEST_CASE("what reordering holds back comes out at the end, duplicates are counted") {
    SessionOptions options;
    options.impairment.reorder = 0.5;
    options.impairment.duplicate = 0.2;
    Session session(one_plan(10'000), options);
    const std::vector<Sent> all = run(session);
    std::map<std::uint16_t, int> seen;
    for (const Sent& datagram : all) ++seen[datagram.header.rtp.sequence];
    CHECK(seen.size() == session.counts().offered);
    CHECK(all.size() == session.counts().offered + session.counts().duplicated);
    CHECK(session.counts().duplicated > 0);
    CHECK_FALSE(std::is_sorted(all.begin(), all.end(), [](const Sent& a, const Sent& b) {
        return a.header.ordinal < b.header.ordinal;
    }));
}

TEST_CASE("an unpaced session hands out batches until it is done") {
    SessionOptions options;
    options.bits_per_second = 0;
    Session session(one_plan(20'000), options);
    std::size_t count = 0;
    while (!session.done()) {
        std::vector<Datagram> out;
        session.poll(1s, out);
        REQUIRE_FALSE(out.empty());
        REQUIRE(out.size() <= Session::kBatch);
        count += out.size();
    }
    CHECK(count == session.counts().offered);
}

namespace {

PlanOptions paged(std::uint32_t rounds) {
    PlanOptions options = plan_options(rounds);
    options.paged = true;
    return options;
}

RoundPlan page_of(std::size_t vertices, std::uint64_t seed, std::uint32_t rounds = 0) {
    sender::BroadcastObject object = made_object(20, vertices, seed);
    object.description.name = "page-" + std::to_string(seed);
    return {std::move(object), paged(rounds)};
}

/// The pages told in datagrams from `begin` on, in order.
std::vector<protocol::PageEntry> pages_in(const std::vector<Sent>& all, std::size_t begin = 0) {
    std::vector<protocol::PageEntry> pages;
    for (std::size_t k = begin; k < all.size(); ++k) {
        const auto view = protocol::parse_datagram(all[k].bytes);
        for (const protocol::SectionView& section : view->sections()) {
            if (section.kind == protocol::SectionKind::page) pages.push_back(section.page());
        }
    }
    return pages;
}

}  // namespace

TEST_CASE("the contents of a carousel are told after as many descriptions as it has pages") {
    std::vector<RoundPlan> plans{page_of(4000, 1), page_of(9000, 2), page_of(500, 3)};
    std::vector<protocol::ObjectId> ids;
    ids.reserve(plans.size());
    for (const RoundPlan& plan : plans) ids.push_back(plan.object().id);
    Session session(std::move(plans), SessionOptions{});
    const std::vector<Sent> all = run(session, 0s, 0s, 2s);
    const std::vector<protocol::PageEntry> pages = pages_in(all);
    REQUIRE(pages.size() > 10);
    std::set<std::uint16_t> heard;
    for (std::size_t k = 0; k < pages.size(); ++k) {
        const protocol::PageEntry& entry = pages[k];
        REQUIRE(entry.pages == 3);
        REQUIRE(entry.version == 1);
        REQUIRE(entry.object == ids[entry.page]);
        REQUIRE(entry.name == "page-" + std::to_string(entry.page + 1));
        REQUIRE(entry.ellipsoids == 20);
        if (k < 6) heard.insert(entry.page);
    }
    CHECK(heard.size() == 3);
}

TEST_CASE("a session of one page tells no contents until the page changes") {
    std::vector<RoundPlan> plans = one_plan(3000, 0);
    Session session(std::move(plans), SessionOptions{});
    std::vector<Sent> all = run(session, 0s, 0s, 100ms);
    CHECK(pages_in(all).empty());
    session.replace(0, page_of(3000, 9));
    all = run(session, 100ms, 0s, 500ms);
    const std::vector<protocol::PageEntry> pages = pages_in(all);
    REQUIRE_FALSE(pages.empty());
    CHECK(pages.front().pages == 1);
    CHECK(pages.front().version == 2);
}

TEST_CASE("a page's new object is on air from its next turn on, laid out as in round 0") {
    std::vector<RoundPlan> plans{page_of(4000, 1), page_of(4000, 2)};
    const protocol::ObjectId before = plans[1].object().id;
    RoundPlan fresh = page_of(4000, 7);
    const protocol::ObjectId after = fresh.object().id;
    Session session(std::move(plans), SessionOptions{});
    // Into the second page's turn of round 1.
    std::vector<Sent> all;
    std::vector<Datagram> out;
    Time now = 0s;
    const auto go = [&](const auto& until) {
        while (!until()) {
            now = std::max(now, session.next_wakeup());
            out.clear();
            session.poll(now, out);
            for (Datagram& datagram : out) all.push_back(sent(now, std::move(datagram)));
        }
    };
    go([&] { return session.round() == 1 && session.page() == 1 && session.ordinal() > 3; });
    session.replace(1, std::move(fresh));
    CHECK(session.plans()[1].object().id == before);
    go([&] { return session.round() == 3 && session.page() == 0; });
    CHECK(session.versions() == std::vector<std::uint32_t>{1, 2});
    CHECK(session.first_round(1) == 2);
    CHECK(session.take_retired().size() == 1);

    std::uint32_t next_vertex = 0;
    std::set<std::uint32_t> rounds_after;
    for (const Sent& datagram : all) {
        const bool old = datagram.header.object == before;
        if (old) CHECK(datagram.header.round < 2);
        if (datagram.header.object != after) continue;
        CHECK(datagram.header.round >= 2);
        rounds_after.insert(datagram.header.round);
        const auto view = protocol::parse_datagram(datagram.bytes);
        for (const protocol::SectionView& section : view->sections()) {
            if (section.kind != protocol::SectionKind::vertices) continue;
            CHECK(section.first == next_vertex);
            next_vertex += section.count;
        }
    }
    CHECK(rounds_after == std::set<std::uint32_t>{2});
    CHECK(next_vertex == 4000);
    for (const protocol::PageEntry& entry : pages_in(all)) {
        if (entry.page == 1) CHECK(entry.version == (entry.object == after ? 2 : 1));
    }
}

TEST_CASE("of several new objects that wait for one turn the last is sent") {
    Session session({page_of(2000, 1), page_of(2000, 2)}, SessionOptions{});
    run(session, 0s, 0s, 1ms);
    session.replace(1, page_of(2000, 3));
    session.replace(1, page_of(2000, 4));
    const auto expected = page_of(2000, 4).object().id;
    run(session, 1ms, 0s, 1s);
    CHECK(session.plans()[1].object().id == expected);
    CHECK(session.versions()[1] == 2);
}

TEST_CASE("a session that shall finish ends with its round") {
    const std::uint32_t rounds = GENERATE(0u, 5u);
    Session session({page_of(2000, 1, rounds), page_of(3000, 2, rounds)}, SessionOptions{});
    run(session, 0s, 0s, 5ms);
    REQUIRE(session.round() == 0);
    session.finish_round();
    const std::vector<Sent> rest = run(session, 5ms);
    CHECK(session.done());
    CHECK(session.cut_short());
    CHECK(session.counts().rounds == 1);
    CHECK(rest.back().header.ordinal + 1 == rest.back().header.datagrams);
    CHECK(rest.back().header.object == session.plans()[1].object().id);
}

TEST_CASE("a session asked to finish in its last round leaves out nothing") {
    Session session(one_plan(2000, 1), SessionOptions{});
    run(session, 0s, 0s, 2ms);
    session.finish_round();
    run(session, 2ms);
    CHECK(session.done());
    CHECK_FALSE(session.cut_short());
}

}  // namespace ellicast::sender
