#include "sender/packing_ahead.hpp"

#include <catch2/catch.hpp>
#include <chrono>

#include "tests/sender/made_objects.hpp"

namespace ellicast::sender {
namespace {

using namespace std::chrono_literals;

Session unpaced_session(std::uint32_t rounds, double drop = 0.0) {
    PlanOptions plan;
    plan.rounds = rounds;
    SessionOptions options;
    options.bits_per_second = 0;
    options.impairment.drop = drop;
    std::vector<RoundPlan> plans{RoundPlan(tests::made_object(100, 20'000), plan)};
    return {std::move(plans), options};
}

std::vector<Datagram> all_of(PackingAhead& ahead) {
    std::vector<Datagram> all;
    std::vector<Datagram> spent;
    for (bool last = false; !last;) {
        PackingAhead::Batch batch = ahead.take(1s, std::move(spent));
        last = batch.last;
        all.insert(all.end(), batch.datagrams.begin(), batch.datagrams.end());
        spent = std::move(batch.datagrams);
    }
    return all;
}

}  // namespace

TEST_CASE("what is packed ahead is what polling gives") {
    Session polled = unpaced_session(5);
    std::vector<Datagram> expected;
    while (!polled.done()) polled.poll(1s, expected);
    Session session = unpaced_session(5);
    PackingAhead ahead(session);
    const std::vector<Datagram> packed = all_of(ahead);
    CHECK(packed.size() > 1000);
    CHECK((packed == expected));
    ahead.settle();
    CHECK(session.done());
    CHECK(session.counts().offered == packed.size());
}

TEST_CASE("a settled session may be changed, and nothing is left out or sent twice") {
    Session session = unpaced_session(0);
    PackingAhead ahead(session);
    std::vector<Datagram> all = ahead.take(1s, {}).datagrams;
    for (int k = 0; k < 20; ++k) {
        ahead.settle();
        const std::uint64_t offered = session.counts().offered;
        CHECK(offered > all.size());  // the next batch is there
        const PackingAhead::Batch batch = ahead.take(1s, {});
        all.insert(all.end(), batch.datagrams.begin(), batch.datagrams.end());
        REQUIRE(all.size() == offered);
    }
    ahead.settle();
    session.finish_round();
    const std::vector<Datagram> rest = all_of(ahead);
    all.insert(all.end(), rest.begin(), rest.end());
    ahead.settle();
    CHECK(session.done());
    CHECK(all.size() % session.plans().front().datagrams() == 0);
    CHECK(all.size() == session.counts().offered);
}

TEST_CASE("where all is lost, batches are empty and whoever waits is not kept waiting") {
    Session session = unpaced_session(0, 1.0);
    PackingAhead ahead(session);
    for (int k = 0; k < 50; ++k) REQUIRE(ahead.take(1s, {}).datagrams.empty());
    ahead.settle();
    CHECK(session.counts().offered > 50);
}

TEST_CASE("who packs ahead may be given up at any moment") {
    for (int batches = 0; batches < 4; ++batches) {
        Session session = unpaced_session(0);
        PackingAhead ahead(session);
        for (int k = 0; k < batches; ++k) REQUIRE_FALSE(ahead.take(1s, {}).datagrams.empty());
    }
}

}  // namespace ellicast::sender
