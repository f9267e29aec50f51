// tests/system/netns_test.cpp: the real pair between two network namespaces, losses by the kernel.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/made_network.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using nlohmann::json;
using tests::ChildProcess;
using tests::MadeNetwork;

namespace {

constexpr int kLossPercent = 30;
constexpr const char* kSpot = "spot.ply";

/// Spot where the reference models are, else a ring.
std::string a_model(const std::filesystem::path& directory) {
    const auto models = tests::models_dir();
    if (models && std::filesystem::exists(*models / kSpot)) return (*models / kSpot).string();
    const auto path = directory / "ring.ply";
    common::write_ply(path, tests::torus(1.0, 0.4, 90, 40));
    return path.string();
}

/// Sends over the lossy cable and checks what came of it.
void check_crossing(MadeNetwork& hosts, const std::string& to) {
    const tests::TemporaryDirectory directory;
    const std::string model = a_model(directory.path());
    const auto path = [&](const char* name) { return (directory.path() / name).string(); };
    const std::uint64_t dropped_before = hosts.dropped();
    ChildProcess receiver(
        "/usr/bin/env", {"ip", "netns", "exec", hosts.receiver(), ELLICAST_RECV, "--output",
                         path("out.ply"), "--report", path("received.json"), "--reference", model});
    REQUIRE(receiver.await_err("listening on "));
    const tests::ProgramOutcome sent =
        tests::run_program({"ip", "netns", "exec", hosts.sender(), ELLICAST_SEND, model, "--to", to,
                            "--candidates", "2500", "--report", path("sent.json")});
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
    MadeNetwork hosts;
    if (!hosts.missing().empty()) {
        WARN("SKIPPED: " << hosts.missing());
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
