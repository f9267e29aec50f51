// tests/sender/status_test.cpp
#include "sender/status.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/sender/made_objects.hpp"

namespace ellicast::sender {

using namespace std::chrono_literals;

TEST_CASE("the status names what is on air") {
    PlanOptions options;
    options.rounds = 0;
    options.paged = true;
    std::vector<RoundPlan> plans;
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        BroadcastObject object = tests::made_object(10, 500, seed);
        object.description.name = seed == 1 ? "one" : "t\xffo";
        plans.emplace_back(std::move(object), options);
    }
    Session session(std::move(plans), SessionOptions{});
    std::vector<Datagram> out;
    session.poll(1s, out);
    EndpointCounts counts;
    counts.sent = out.size();
    const auto json = nlohmann::json::parse(
        status_json({"sending", "192.0.2.1:5004", 1500ms, 1'000'000, 9e5}, session, counts));
    CHECK(json["state"] == "sending");
    CHECK(json["seconds"] == 1.5);
    CHECK(json["round"] == 0);
    CHECK(json["rounds"] == 0);
    CHECK(json["page"]["name"] == "one");
    CHECK(json["page"]["ordinal"] == out.size());
    CHECK(json["pages"].size() == 2);
    CHECK(json["pages"][1]["version"] == 1);
    CHECK(json["pages"][1]["vertices"] == 500);
    CHECK(json["rate"]["recent"] == 9e5);
    CHECK(json["datagrams"]["sent"] == out.size());
}

}  // namespace ellicast::sender
