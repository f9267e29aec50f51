// tests/system/netns_test.cpp: the real pair between two network namespaces, losses by the kernel.
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using nlohmann::json;
using tests::ChildProcess;
using Arguments = std::vector<std::string>;

namespace {

constexpr int kLossPercent = 30;
constexpr const char* kSpot = "spot.ply";

struct Outcome {
    int code = 127;
    std::string out;
    std::string err;
};

Outcome run(const Arguments& words) {
    // env looks the program up.
    ChildProcess process("/usr/bin/env", words);
    Outcome outcome;
    outcome.code = process.wait();
    outcome.out = process.out();
    outcome.err = process.err();
    return outcome;
}

bool succeeds(const Arguments& words) {
    return run(words).code == 0;
}

/// Two hosts joined by a cable, as network namespaces of this process; gone with the object.
class TwoHosts {
  public:
    TwoHosts() {
        made_ = succeeds({"ip", "netns", "add", sender()}) &&
                succeeds({"ip", "netns", "add", receiver()}) &&
                succeeds({"ip", "-n", sender(), "link", "add", "far", "type", "veth", "peer",
                          "name", "near", "netns", receiver()}) &&
                bring_up(sender(), "far", "1") && bring_up(receiver(), "near", "2");
    }
    ~TwoHosts() {
        // Programs first: a namespace lives on while one is in it.
        for (const std::string& name : {sender(), receiver()}) run({"ip", "netns", "del", name});
    }
    TwoHosts(const TwoHosts&) = delete;
    TwoHosts& operator=(const TwoHosts&) = delete;

    [[nodiscard]] bool made() const { return made_; }
    [[nodiscard]] std::string sender() const { return name_ + "-send"; }
    [[nodiscard]] std::string receiver() const { return name_ + "-recv"; }

    /// Drops a share of the UDP datagrams that reach the receiving host; false where the kernel
    /// cannot.
    bool lose(int percent) {
        const Arguments in{"ip", "netns", "exec", receiver()};
        const auto nft = [&](const std::string& command) {
            Arguments words = in;
            words.insert(words.end(), {"nft", command});
            return succeeds(words);
        };
        with_nft_ = nft("add table inet loss") &&
                    nft("add chain inet loss in { type filter hook input priority 0; }") &&
                    nft("add rule inet loss in iifname \"near\" udp dport 5004 numgen random mod "
                        "100 < " +
                        std::to_string(percent) + " counter drop");
        if (with_nft_) return true;
        bool both = true;
        for (const std::string tool : {"iptables", "ip6tables"}) {
            Arguments words = in;
            words.insert(words.end(),
                         {tool, "-A", "INPUT", "-i", "near", "-p", "udp", "--dport", "5004", "-m",
                          "statistic", "--mode", "random", "--probability",
                          std::to_string(percent / 100.0), "-j", "DROP"});
            both = both && succeeds(words);
        }
        return both;
    }

    /// Datagrams that the rules dropped.
    [[nodiscard]] std::uint64_t dropped() const {
        const Arguments in{"ip", "netns", "exec", receiver()};
        if (with_nft_) {
            Arguments words = in;
            words.insert(words.end(), {"nft", "-j", "list", "table", "inet", "loss"});
            return counted(json::parse(run(words).out));
        }
        std::uint64_t sum = 0;
        for (const std::string tool : {"iptables", "ip6tables"}) {
            Arguments words = in;
            words.insert(words.end(), {tool, "-L", "INPUT", "1", "-v", "-x", "-n"});
            sum += std::strtoull(run(words).out.c_str(), nullptr, 10);
        }
        return sum;
    }

  private:
    static bool bring_up(const std::string& name, const std::string& device,
                         const std::string& last) {
        return succeeds({"ip", "-n", name, "link", "set", "lo", "up"}) &&
               succeeds({"ip", "-n", name, "link", "set", device, "up"}) &&
               succeeds({"ip", "-n", name, "address", "add", "10.77.0." + last + "/24", "dev",
                         device}) &&
               // Without waiting for somebody else to claim the address.
               succeeds({"ip", "-n", name, "address", "add", "fd77::" + last + "/64", "dev", device,
                         "nodad"});
    }
    static std::uint64_t counted(const json& ruleset) {
        std::uint64_t sum = 0;
        for (const json& item : ruleset["nftables"]) {
            if (!item.contains("rule")) continue;
            for (const json& part : item["rule"]["expr"]) {
                if (part.contains("counter"))
                    sum += part["counter"]["packets"].get<std::uint64_t>();
            }
        }
        return sum;
    }

    std::string name_ = "ellicast-" + std::to_string(::getpid());
    bool made_ = false;
    bool with_nft_ = false;
};

/// Spot where the reference models are, else a ring.
std::string a_model(const std::filesystem::path& directory) {
    const auto models = tests::models_dir();
    if (models && std::filesystem::exists(*models / kSpot)) return (*models / kSpot).string();
    const auto path = directory / "ring.ply";
    common::write_ply(path, tests::torus(1.0, 0.4, 90, 40));
    return path.string();
}

/// Sends over the lossy cable and checks what came of it.
void check_crossing(TwoHosts& hosts, const std::string& to) {
    const tests::TemporaryDirectory directory;
    const std::string model = a_model(directory.path());
    const auto path = [&](const char* name) { return (directory.path() / name).string(); };
    const std::uint64_t dropped_before = hosts.dropped();
    ChildProcess receiver(
        "/usr/bin/env", {"ip", "netns", "exec", hosts.receiver(), ELLICAST_RECV, "--output",
                         path("out.ply"), "--report", path("received.json"), "--reference", model});
    REQUIRE(receiver.await_err("listening on "));
    const Outcome sent = run({"ip", "netns", "exec", hosts.sender(), ELLICAST_SEND, model, "--to",
                              to, "--candidates", "2500", "--report", path("sent.json")});
    INFO(sent.err);
    REQUIRE(sent.code == 0);
    CHECK(receiver.wait() == 0);
    INFO(receiver.err());

    const json received = json::parse(tests::read_file(path("received.json")));
    const json counts = received["datagrams"];
    const json sending = json::parse(tests::read_file(path("sent.json")))["sending"];
    const std::uint64_t dropped = hosts.dropped() - dropped_before;
    const std::uint64_t offered = sending["datagrams"]["sent"];
    WARN(to << ": " << offered << " datagrams sent, " << dropped
            << " dropped by the kernel's rule, " << counts["lost"] << " counted as lost; rms "
            << received["quality"]["rms"] << ", genus " << received["mesh"]["genus"]);
    // The rule does what it says, by three standard deviations, and every gap was seen.
    const double expected = static_cast<double>(offered) * kLossPercent / 100.0;
    const double deviation = std::sqrt(expected * (1.0 - kLossPercent / 100.0));
    CHECK(std::abs(static_cast<double>(dropped) - expected) <= 3.5 * deviation);
    CHECK(counts["received"].get<std::uint64_t>() == offered - dropped);
    CHECK(counts["kernel_dropped"] == 0);
    const double miscounted = counts["lost"].get<double>() - static_cast<double>(dropped);
    CHECK(std::abs(miscounted) <= std::max(1.0, 0.01 * static_cast<double>(offered)));

    const common::MeshTopology mesh = common::analyse_topology(common::read_model(path("out.ply")));
    const common::MeshTopology original = common::analyse_topology(common::read_model(model));
    CHECK(mesh.closed);
    CHECK(mesh.manifold);
    CHECK(mesh.components == 1);
    CHECK(mesh.genus() == original.genus());
    CHECK(received["mesh"]["topology_as_promised"] == true);
}

}  // namespace

TEST_CASE("between two hosts, what the kernel loses is counted and the surface is closed") {
    if (::geteuid() != 0 || !succeeds({"ip", "-V"})) {
        WARN("SKIPPED: network namespaces need root and iproute2");
        return;
    }
    TwoHosts hosts;
    if (!hosts.made()) {
        WARN("SKIPPED: no rights to make network namespaces joined by a veth pair");
        return;
    }
    if (!hosts.lose(kLossPercent)) {
        WARN("SKIPPED: neither nft's numgen nor iptables' statistic match works here");
        return;
    }
    SECTION("over IPv4") {
        check_crossing(hosts, "10.77.0.2");
    }
    SECTION("over IPv6") {
        check_crossing(hosts, "[fd77::2]");
    }
}
