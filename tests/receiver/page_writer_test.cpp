// tests/receiver/page_writer_test.cpp: pages written while they are received, and the status of it.
#include "receiver/page_writer.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "receiver/status.hpp"
#include "receiver/udp_endpoint.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/datagrams.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;

namespace {

const tests::MadeObject& object() {
    static const tests::MadeObject made = tests::made_sphere(800, 25);
    return made;
}

SessionOptions forever() {
    SessionOptions options;
    options.until = Until::forever;
    options.pages.all = true;
    return options;
}

void receive(Session& session, const std::vector<tests::Datagram>& datagrams, std::size_t skip) {
    for (std::size_t k = 0; k < datagrams.size(); ++k) {
        if (k != skip) session.on_datagram(1s, Source{}, datagrams[k]);
    }
}

PageResult written_of(const RecordStore::Group& group) {
    PageResult result;
    result.object = group.object;
    result.ellipsoids = group.ellipsoids.size();
    result.vertices = group.vertices.size();
    return result;
}

}  // namespace

TEST_CASE("a page is due when it is complete or a round is over, and it has changed") {
    tests::MadeStream stream;
    stream.rounds = 0;
    const auto datagrams = tests::made_datagrams(object(), stream, 2);
    const std::size_t round = datagrams.size() / 2;
    Session session(forever(), 0s);
    for (std::size_t k = 0; k + 1 < round; ++k) {
        session.on_datagram(1s, Source{}, datagrams[k]);
        REQUIRE_FALSE(PageSchedule::due(*session.shown(), nullptr, 0));
    }
    const auto due = [&](const PageResult* written, std::uint64_t rounds) {
        return PageSchedule::due(*session.shown(), written, rounds);
    };
    SECTION("complete") {
        session.on_datagram(1s, Source{}, datagrams[round - 1]);
        REQUIRE(session.shown()->complete());
        CHECK(due(nullptr, 0));
        const PageResult written = written_of(*session.shown());
        CHECK_FALSE(due(&written, 1));
        PageResult other = written;
        other.object[0] ^= 1;
        CHECK(due(&other, 1));
    }
    SECTION("a round over, its last datagram lost") {
        session.on_datagram(1s, Source{}, datagrams[round]);
        REQUIRE_FALSE(session.shown()->complete());
        CHECK(due(nullptr, 0));
        PageResult written = written_of(*session.shown());
        CHECK_FALSE(due(&written, 0));
        written.vertices -= 5;
        CHECK(due(&written, 0));
        CHECK_FALSE(due(&written, 1));  // not again in the same round
    }
}

TEST_CASE("a writer keeps the file of a page, and the status says where it is") {
    const tests::TemporaryDirectory directory;
    PageWriter writer({directory.path(), 24, true, 100});
    Session session(forever(), 0s);
    receive(session, tests::made_datagrams(object()), 1'000'000);
    const auto file = directory.path() / "made-sphere.ply";
    Time now = 1s;
    while (writer.written().empty()) {
        writer.on_tick(now += 1ms, session);
        std::this_thread::yield();
    }
    REQUIRE(std::filesystem::exists(file));
    CHECK(common::analyse_topology(common::read_model(file)).closed);
    const PageResult& result = writer.written().at("made-sphere");
    CHECK(result.complete);
    CHECK(result.id_verified);
    CHECK(result.output == file);

    StatusFacts facts;
    facts.written = &writer.written();
    const auto status = status_json(facts, session, now);
    CHECK(status["page"] == "made-sphere");
    CHECK(status["round"] == 0);
    REQUIRE(status["pages"].size() == 1);
    CHECK(status["pages"][0]["complete"] == true);
    CHECK(status["pages"][0]["valid"] == true);
    CHECK(status["pages"][0]["output"] == file.string());
    CHECK(status["datagrams"]["received"] > 0);
    CHECK(status["datagrams"].contains("bursts"));
    CHECK(status["others"]["groups"] == 0);
    CHECK(status["live"].is_null());
}

TEST_CASE("a page that cannot be written is said so, and is no end of the world") {
    PageWriter writer({"/nowhere/at/all", 24, true, 100});
    Session session(forever(), 0s);
    receive(session, tests::made_datagrams(object()), 1'000'000);
    Time now = 1s;
    while (writer.written().empty()) {
        writer.on_tick(now += 1ms, session);
        std::this_thread::yield();
    }
    CHECK_FALSE(writer.written().at("made-sphere").error.empty());
}

TEST_CASE("the status of nothing is waiting, without a page") {
    const Session session(forever(), 0s);
    StatusFacts facts;
    facts.state = "waiting";
    const auto status = status_json(facts, session, 1s);
    CHECK(status["state"] == "waiting");
    CHECK(status["page"].is_null());
    CHECK(status["round"].is_null());
    CHECK(status["pages"].empty());
}

TEST_CASE("the status file has the recent rate") {
    const tests::TemporaryDirectory directory;
    const auto path = directory.path() / "status.json";
    StatusFile file(path);
    Session session(forever(), 0s);
    CHECK(file.due(0s));
    file.write({}, session, 0s);
    CHECK_FALSE(file.due(999ms));
    CHECK(file.due(1s));
    const auto datagrams = tests::made_datagrams(object());
    receive(session, datagrams, 1'000'000);
    std::size_t bytes = 0;
    for (const auto& datagram : datagrams) bytes += datagram.size();
    file.write({}, session, 2s);
    const auto status = nlohmann::json::parse(tests::read_file(path));
    CHECK(status["rate"]["recent"].get<double>() == Approx(8.0 * static_cast<double>(bytes) / 2.0));
}
