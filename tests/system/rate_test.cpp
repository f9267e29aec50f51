// tests/system/rate_test.cpp: rates that an interface does not keep.
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/made_network.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using nlohmann::json;
using tests::MadeNetwork;
using tests::ProgramOutcome;
using tests::run_program;
using Words = std::vector<std::string>;

namespace {

constexpr double kShapedTo = 5e6;  // bits per second

/// A sender of a ring to the other host.
struct Place {
    MadeNetwork network;
    tests::TemporaryDirectory directory;

    Place() { common::write_ply(path("ring.ply"), tests::torus(1.0, 0.4, 60, 30)); }
    [[nodiscard]] std::string path(const std::string& name) const {
        return (directory.path() / name).string();
    }
    [[nodiscard]] ProgramOutcome send(const Words& more) const {
        Words words{ELLICAST_SEND, path("ring.ply"), "--refine", "off", "--candidates",
                    "300",         "--ellipsoids",   "60"};
        words.insert(words.end(), more.begin(), more.end());
        return run_program(MadeNetwork::inside(network.sender(), words));
    }
    /// Packets at the other host: datagrams, and a few of those that hosts exchange.
    [[nodiscard]] std::uint64_t arrived() const {
        return std::stoull(
            run_program(MadeNetwork::inside(network.receiver(),
                                            {"cat", "/sys/class/net/near/statistics/rx_packets"}))
                .out);
    }
    /// What leaves the sender is held to 5 Mbit/s, in a queue of that many bytes.
    [[nodiscard]] bool shape(const std::string& queue) const {
        return run_program(MadeNetwork::inside(network.sender(),
                                               {"tc", "qdisc", "add", "dev", "near", "root", "tbf",
                                                "rate", "5mbit", "burst", "16k", "limit", queue}))
                   .code == 0;
    }
};

}  // namespace

TEST_CASE("a rate that an interface cannot keep ends with a line that says what it kept") {
    const Place place;
    if (!place.network.missing().empty()) {
        WARN("SKIPPED: " << place.network.missing());
        return;
    }
    // A queue that is larger than the socket's buffer, and one that overflows long before.
    const bool deep = GENERATE(true, false);
    if (!place.shape(deep ? "64m" : "20k")) {
        WARN("SKIPPED: this kernel has no token bucket filter (tc tbf)");
        return;
    }
    const std::string to = deep ? "10.77.0.2" : "[fd77::2]";
    SECTION("instead of a carousel that is slower than was told") {
        const std::uint64_t before = place.arrived();
        const ProgramOutcome outcome = place.send({"--to", to, "--rounds", "forever", "--rate",
                                                   "50M", "--report", place.path("report.json")});
        INFO(outcome.err);
        CHECK(outcome.code == 5);
        CHECK_THAT(outcome.err, Catch::Contains("error: --rate: 50 Mbit/s were asked for, and"));
        const json sending = json::parse(tests::read_file(place.path("report.json")))["sending"];
        CHECK(sending["interrupted"] == true);
        CHECK(sending["datagrams"]["socket_full"] > 0);
        CHECK(sending["datagrams"]["refused"] == 0);
        CHECK(sending["rate"]["asked"] == 50'000'000);
        // With what the socket's buffer took beforehand.
        CHECK(sending["rate"]["achieved"].get<double>() >= 0.9 * kShapedTo);
        CHECK(sending["rate"]["achieved"].get<double>() < 0.9 * 50e6);
        // No queue has lost any of it, and what still waits there comes.
        const auto sent = sending["datagrams"]["sent"].get<std::uint64_t>();
        for (int k = 0; k < 300 && place.arrived() - before < sent; ++k) {
            std::this_thread::sleep_for(100ms);
        }
        CHECK(place.arrived() - before >= sent);
    }
    SECTION("and one that it keeps does not") {
        if (deep) return;  // the same
        const ProgramOutcome outcome = place.send({"--to", to, "--rounds", "40", "--rate", "4M"});
        INFO(outcome.err);
        CHECK(outcome.code == 0);
        CHECK_THAT(outcome.err, !Catch::Contains("--rate"));
    }
}

TEST_CASE("a rate above the link's is refused before any work") {
    const Place place;
    if (!place.network.missing().empty()) {
        WARN("SKIPPED: " << place.network.missing());
        return;
    }
    // A veth says that it is a link of 10 Gbit/s.
    const bool group = GENERATE(false, true);
    const Words to =
        group ? Words{"--to", "239.255.77.1", "--interface", "near"} : Words{"--to", "10.77.0.2"};
    const auto send = [&](const char* rate) {
        Words words = to;
        words.insert(words.end(), {"--rate", rate});
        return place.send(words);
    };
    const ProgramOutcome outcome = send("10.5G");
    CHECK(outcome.code == 2);
    CHECK(outcome.err ==
          "ellicast-send: --rate: 10500 Mbit/s are more than the 10000 Mbit/s of near\n");
    CHECK(send("10G").code == 0);
}
