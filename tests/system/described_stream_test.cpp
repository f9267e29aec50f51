// tests/system/described_stream_test.cpp: what the sender writes about its stream is all that a
// receiver needs.
#include <catch2/catch.hpp>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/made_network.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using nlohmann::json;
using tests::ChildProcess;
using tests::MadeNetwork;
using Words = std::vector<std::string>;

namespace {

/// A carousel that describes itself, and what it takes to listen to it.
struct Place {
    tests::TemporaryDirectory directory;

    Place() { common::write_ply(path("ring.ply"), tests::torus(1.0, 0.4, 60, 30)); }
    [[nodiscard]] std::string path(const std::string& name) const {
        return (directory.path() / name).string();
    }
    [[nodiscard]] Words sending(const std::string& to, const Words& more = {}) const {
        Words words{path("ring.ply"),
                    "--to",
                    to,
                    "--rounds",
                    "forever",
                    "--rate",
                    "2M",
                    "--sdp",
                    path("sdp"),
                    "--refine",
                    "off",
                    "--candidates",
                    "300",
                    "--ellipsoids",
                    "60"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    /// Runs a receiver to its end.
    [[nodiscard]] Words listening(const Words& more = {}) const {
        Words words{"--sdp",   path("sdp"), "--output", path("out.ply"),
                    "--until", "complete",  "--report", path("report.json")};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    [[nodiscard]] json report() const { return json::parse(tests::read_file(path("report.json"))); }
    /// Puts one text for another in the description.
    void change(const std::string& from, const std::string& to) const {
        std::string text = tests::read_file(path("sdp"));
        REQUIRE(text.find(from) != std::string::npos);
        for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
            text.replace(at, from.size(), to);
        }
        std::ofstream(path("sdp"), std::ios::binary) << text;
    }
};

Words with_program(const char* program, const Words& words) {
    Words all{program};
    all.insert(all.end(), words.begin(), words.end());
    return all;
}

}  // namespace

TEST_CASE("a receiver on this host needs the description alone") {
    const Place place;
    const std::string port = std::to_string(tests::free_port());
    ChildProcess sender(ELLICAST_SEND, place.sending("127.0.0.1:" + port));
    REQUIRE(sender.await_err("described in "));
    SECTION("and has the model") {
        ChildProcess receiver(ELLICAST_RECV, place.listening());
        const int code = receiver.wait();
        INFO(receiver.err());
        CHECK(code == 0);
        CHECK_THAT(receiver.err(), Catch::Contains("listening on [::]:" + port));
        CHECK(place.report()["object"]["complete"] == true);
    }
    SECTION("and takes nothing of another payload type") {
        place.change("RTP/AVP 96", "RTP/AVP 97");
        place.change("rtpmap:96", "rtpmap:97");
        ChildProcess receiver(ELLICAST_RECV, place.listening({"--wait", "1"}));
        CHECK(receiver.wait() == 3);
        CHECK_THAT(receiver.err(), Catch::Contains("refused as other_payload_type"));
    }
    sender.send_signal(SIGINT);
    CHECK(sender.wait() == 0);
}

TEST_CASE("a key in a description is a hint and never taken") {
    const Place place;
    const std::string port = std::to_string(tests::free_port());
    const std::string to = "127.0.0.1:" + port;
    REQUIRE(tests::run_program({ELLICAST_SEND, "key", "--output", place.path("key")}).code == 0);
    std::string key = tests::read_file(place.path("key.pub"));
    key.pop_back();
    ChildProcess sender(ELLICAST_SEND, place.sending(to, {"--sign", place.path("key")}));
    REQUIRE(sender.await_err("described in "));
    ChildProcess described(ELLICAST_RECV, place.listening());
    CHECK(described.wait() == 0);
    CHECK_THAT(described.err(), Catch::Contains("--verify " + key));
    CHECK(place.report()["authenticity"]["verified_by"].is_null());
    ChildProcess verifying(ELLICAST_RECV, place.listening({"--verify", key}));
    CHECK(verifying.wait() == 0);
    CHECK_THAT(verifying.err(), !Catch::Contains("--verify"));
    CHECK(place.report()["authenticity"]["verified_by"] == key);
}

TEST_CASE("a receiver of a group joins it by the description, for its source alone") {
    MadeNetwork network(2);
    if (!network.missing().empty()) {
        WARN("SKIPPED: " << network.missing());
        return;
    }
    const Place place;
    const bool v6 = GENERATE(false, true);
    const std::string own = v6 ? "fd77::1" : "10.77.0.1";
    const std::string other = v6 ? "fd77::3" : "10.77.0.3";
    ChildProcess sender(
        "/usr/bin/env",
        MadeNetwork::inside(
            network.sender(),
            with_program(ELLICAST_SEND, place.sending(v6 ? "[ff35::77]:5004" : "232.7.7.7:5004",
                                                      {"--interface", "near"}))));
    REQUIRE(sender.await_err("described in "));
    const auto listen = [&](const Words& more) {
        Words words{"--interface", "near"};
        words.insert(words.end(), more.begin(), more.end());
        return tests::run_program(MadeNetwork::inside(
            network.receiver(), with_program(ELLICAST_RECV, place.listening(words))));
    };
    const tests::ProgramOutcome heard = listen({});
    INFO(heard.err);
    CHECK(heard.code == 0);
    CHECK(place.report()["object"]["complete"] == true);
    place.change(own + "\r\nm=", other + "\r\nm=");
    CHECK(listen({"--wait", "1"}).code == 3);
}
