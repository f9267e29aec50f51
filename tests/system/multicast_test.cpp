// tests/system/multicast_test.cpp: one sender and eight receivers on one cable, each with a loss of
// its own.
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/made_network.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using nlohmann::json;
using tests::ChildProcess;
using tests::MadeNetwork;
using tests::ProgramOutcome;
using tests::run_program;
using Words = std::vector<std::string>;

namespace {

constexpr std::array<int, 8> kLossPercent{0, 1, 5, 10, 30, 50, 70, 90};
constexpr int kTopologyUpTo = 70;  // percent

std::string torus_in(const std::filesystem::path& directory, int around, int across) {
    const auto path = directory / "ring.ply";
    common::write_ply(path, tests::torus(1.0, 0.4, around, across));
    return path.string();
}

std::string at(const std::filesystem::path& directory, std::size_t k, const char* suffix) {
    return (directory / (std::to_string(k) + suffix)).string();
}

/// Sends the model to a group; the same bytes each time, but for the moments of sending.
ProgramOutcome send(const MadeNetwork& network, const std::string& model, const std::string& to,
                    const Words& more = {}) {
    Words words{ELLICAST_SEND,
                model,
                "--to",
                to,
                "--datagram",
                "576",
                "--copies",
                "3",
                "--refine",
                "off",
                "--candidates",
                "500",
                "--cache",
                std::filesystem::path(model).parent_path() / "cache",
                "--rate",
                "10M",
                "--session",
                "00112233445566aa",
                "--ssrc",
                "7",
                "--first-sequence",
                "65000"};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(MadeNetwork::inside(network.sender(), words));
}

std::unique_ptr<ChildProcess> listen(const MadeNetwork& network, std::size_t k, const Words& more) {
    Words words{ELLICAST_RECV, "--threads", "1", "--grid", "64"};
    words.insert(words.end(), more.begin(), more.end());
    auto receiver = std::make_unique<ChildProcess>("/usr/bin/env",
                                                   MadeNetwork::inside(network.receiver(k), words));
    INFO(receiver->err());
    REQUIRE(receiver->await_err("listening on "));
    return receiver;
}

constexpr std::chrono::seconds kForAnything(30);
constexpr std::chrono::seconds kForNothing(2);

/// Whether the receiver got anything of what has been sent to its end, by its status file. Nothing
/// is on its way on these cables any more: patience is for busy machines.
bool something_came(ChildProcess& receiver, const std::string& status_file,
                    std::chrono::seconds patience) {
    const bool came = tests::eventually(
        [&] {
            const json status = json::parse(tests::read_file(status_file), nullptr, false);
            return !status.is_discarded() && status["datagrams"]["received"] > 0;
        },
        patience);
    receiver.send_signal(SIGINT);
    const int code = receiver.wait();
    INFO(receiver.err());
    CHECK(code == (came ? 0 : 3));
    return came;
}

/// What one receiver made of a stream of `sent` datagrams.
void check_receiver(const json& received, const std::string& mesh_file, int percent,
                    std::uint64_t sent, std::uint64_t dropped) {
    const double all = static_cast<double>(sent);
    const double lost = received["datagrams"]["lost"].get<double>();
    WARN(percent << " %: " << dropped << " of " << sent << " dropped by the kernel's rule, " << lost
                 << " counted as lost; genus " << received["mesh"]["genus"]);
    CHECK(received["datagrams"]["received"].get<std::uint64_t>() == sent - dropped);
    CHECK(received["datagrams"]["kernel_dropped"] == 0);
    CHECK(std::abs(lost - static_cast<double>(dropped)) <= 0.01 * all);
    const common::MeshTopology mesh = common::analyse_topology(common::read_model(mesh_file));
    CHECK(mesh.closed);
    CHECK(mesh.manifold);
    if (percent > kTopologyUpTo) return;
    CHECK(mesh.components == 1);
    CHECK(mesh.genus() == 1);
    CHECK(received["mesh"]["topology_as_promised"] == true);
}

void check_group(MadeNetwork& network, const std::string& group) {
    const tests::TemporaryDirectory directory;
    const std::string model = torus_in(directory.path(), 180, 90);  // more than 400 datagrams
    std::vector<std::unique_ptr<ChildProcess>> receivers;
    std::vector<std::uint64_t> dropped_before;
    for (std::size_t k = 0; k < kLossPercent.size(); ++k) {
        dropped_before.push_back(network.dropped(k));
        receivers.push_back(listen(
            network, k,
            {"--listen", group, "--interface", "near", "--output", at(directory.path(), k, ".ply"),
             "--report", at(directory.path(), k, ".json")}));
    }
    const MadeNetwork::Traffic before = network.left_sender();
    const std::string report = (directory.path() / "sent.json").string();
    const ProgramOutcome sent =
        send(network, model, group, {"--interface", "near", "--report", report});
    INFO(sent.err);
    REQUIRE(sent.code == 0);
    const MadeNetwork::Traffic heard = network.left_sender();
    const json sending = json::parse(tests::read_file(report))["sending"];
    const auto datagrams = sending["datagrams"]["sent"].get<std::uint64_t>();
    CHECK(datagrams >= 400);
    CHECK(heard.packets - before.packets == datagrams);

    for (std::size_t k = 0; k < receivers.size(); ++k) {
        const int code = receivers[k]->wait();
        INFO(receivers[k]->err());
        if (kLossPercent[k] <= kTopologyUpTo) REQUIRE(code == 0);
        REQUIRE((code == 0 || code == 4));
        check_receiver(json::parse(tests::read_file(at(directory.path(), k, ".json"))),
                       at(directory.path(), k, ".ply"), kLossPercent[k], datagrams,
                       network.dropped(k) - dropped_before[k]);
    }

    // To nobody the same goes out.
    REQUIRE(send(network, model, group, {"--interface", "near"}).code == 0);
    const MadeNetwork::Traffic unheard = network.left_sender();
    CHECK(unheard.packets - heard.packets == heard.packets - before.packets);
    CHECK(unheard.bytes - heard.bytes == heard.bytes - before.bytes);
}

}  // namespace

TEST_CASE("eight receivers of one group, each with its own loss, all end with a closed mesh") {
    MadeNetwork network(kLossPercent.size());
    if (!network.missing().empty()) {
        WARN("SKIPPED: " << network.missing());
        return;
    }
    for (std::size_t k = 0; k < kLossPercent.size(); ++k) {
        if (!network.lose(kLossPercent[k], k)) {
            WARN("SKIPPED: neither nft's numgen nor iptables' statistic match works here");
            return;
        }
    }
    SECTION("over IPv4") {
        check_group(network, "239.255.77.1:5004");
    }
    SECTION("over IPv6") {
        check_group(network, "[ff15::77]:5004");
    }
}

TEST_CASE("groups of one link, sources, other interfaces and broadcast are told apart") {
    MadeNetwork network(2);
    if (!network.missing().empty()) {
        WARN("SKIPPED: " << network.missing());
        return;
    }
    const tests::TemporaryDirectory directory;
    const std::string model = torus_in(directory.path(), 40, 20);
    const std::string status = (directory.path() / "status.json").string();
    const auto hears = [&](const Words& listening, const std::string& to, const Words& sending,
                           std::chrono::seconds patience = kForAnything) {
        std::filesystem::remove(status);
        Words words{"--output", (directory.path() / "out.ply").string()};
        words.insert(words.end(), listening.begin(), listening.end());
        words.insert(words.end(), {"--status", status});
        const auto receiver = listen(network, 0, words);
        const ProgramOutcome sent = send(network, model, to, sending);
        INFO(sent.err);
        REQUIRE(sent.code == 0);
        return something_came(*receiver, status, patience);
    };
    SECTION("a group of the link") {
        CHECK(hears({"--listen", "[ff02::77]:5004", "--interface", "near"}, "[ff02::77]:5004",
                    {"--interface", "near"}));
        CHECK(hears({"--listen", "[ff02::77%near]:5004"}, "[ff02::77%near]:5004", {}));
    }
    SECTION("another group is not heard") {
        CHECK_FALSE(hears({"--listen", "239.255.77.2:5004", "--interface", "near"},
                          "239.255.77.1:5004", {"--interface", "near"}, kForNothing));
    }
    SECTION("the source that was asked for is heard, and no other") {
        const bool v6 = GENERATE(false, true);
        const std::string group = v6 ? "[ff35::77]:5004" : "232.7.7.7:5004";
        const std::string right = v6 ? "fd77::1" : "10.77.0.1";
        const std::string wrong = v6 ? "fd77::3" : "10.77.0.3";
        const Words sending{"--interface", "near", "--ttl", "4", "--dscp", "34"};
        const Words listening{"--listen", group, "--interface", "near", "--source"};
        CHECK(
            hears({listening[0], group, "--interface", "near", "--source", right}, group, sending));
        CHECK_FALSE(hears({listening[0], group, "--interface", "near", "--source", wrong}, group,
                          sending, kForNothing));
    }
    SECTION("broadcast, for those who ask") {
        const ProgramOutcome refused = send(network, model, "10.77.0.255:5004");
        CHECK(refused.code == 2);
        CHECK_THAT(refused.err, Catch::Contains("--broadcast"));
        CHECK(hears({}, "10.77.0.255:5004", {"--broadcast"}));
    }
    SECTION("loopback") {
        const auto here = [&](const char* loopback, std::chrono::seconds patience) {
            std::filesystem::remove(status);
            ChildProcess receiver(
                "/usr/bin/env",
                MadeNetwork::inside(
                    network.sender(),
                    {ELLICAST_RECV, "--listen", "239.255.77.1:5004", "--interface", "near",
                     "--output", (directory.path() / "here.ply").string(), "--status", status}));
            REQUIRE(receiver.await_err("listening on "));
            REQUIRE(send(network, model, "239.255.77.1:5004",
                         {"--interface", "near", "--loopback", loopback})
                        .code == 0);
            return something_came(receiver, status, patience);
        };
        CHECK(here("on", kForAnything));
        CHECK_FALSE(here("off", kForNothing));
    }
}

TEST_CASE("what cannot be is told in a line that names the option") {
    MadeNetwork network(1);
    if (!network.missing().empty()) {
        WARN("SKIPPED: " << network.missing());
        return;
    }
    const tests::TemporaryDirectory directory;
    const std::string model = torus_in(directory.path(), 40, 20);
    const auto sending = [&](const std::string& to, const Words& more) {
        Words words{ELLICAST_SEND, model, "--to", to};
        words.insert(words.end(), more.begin(), more.end());
        const ProgramOutcome outcome = run_program(MadeNetwork::inside(network.sender(), words));
        CHECK(outcome.code == 2);
        return outcome.err;
    };
    const auto listening = [&](const Words& more) {
        Words words{ELLICAST_RECV};
        words.insert(words.end(), more.begin(), more.end());
        const ProgramOutcome outcome = run_program(MadeNetwork::inside(network.receiver(), words));
        CHECK(outcome.code == 2);
        return outcome.err;
    };
    CHECK_THAT(sending("239.255.77.1", {"--interface", "far"}),
               Catch::Contains("--interface: there is no 'far'"));
    CHECK_THAT(sending("239.255.77.1", {}), Catch::Contains("--interface"));
    CHECK_THAT(sending("10.77.0.2", {"--loopback", "on"}), Catch::Contains("--loopback"));
    CHECK_THAT(sending("10.77.0.2", {"--datagram", "1473"}), Catch::Contains("--datagram 1472"));
    CHECK_THAT(sending("[fd77::2]", {"--datagram", "1453"}), Catch::Contains("--datagram 1452"));
    CHECK_THAT(listening({"--listen", "239.255.77.1:5004", "--interface", "far"}),
               Catch::Contains("--interface: there is no 'far'"));
    CHECK_THAT(listening({"--listen", ":5004", "--source", "10.77.0.1"}),
               Catch::Contains("--source"));
    CHECK_THAT(
        listening({"--listen", "239.255.77.1:5004", "--interface", "near", "--source", "fd77::1"}),
        Catch::Contains("--source"));
}
