// tests/system/pair_test.cpp: both real programs, joined over loopback.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>
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
using Bits = std::array<float, 3>;

namespace {

/// Options that stand already are left alone.
void add_defaults(const std::vector<std::array<std::string, 2>>& defaults, Arguments& arguments) {
    const Arguments given = arguments;
    for (const auto& [option, value] : defaults) {
        if (std::count(given.begin(), given.end(), option) > 0) continue;
        arguments.insert(arguments.end(), {option, value});
    }
}

/// A directory with a ring and a ball in it, and the two programs on one port. Few candidates and
/// a coarse grid keep them quick.
class Pair {
  public:
    Pair() {
        common::write_ply(ring(), tests::torus(1.0, 0.4, 60, 30));  // 1800 vertices, genus 1
        common::write_ply(ball(), tests::icosphere(3));             // 642
    }

    [[nodiscard]] std::filesystem::path path(const std::string& name) const {
        return directory_.path() / name;
    }
    [[nodiscard]] std::string ring() const { return path("ring.ply").string(); }
    [[nodiscard]] std::string ball() const { return path("ball.ply").string(); }
    [[nodiscard]] std::string output() const { return path("out.ply").string(); }

    /// Starts the receiver and waits until it listens.
    void listen(const Arguments& more = {}) {
        Arguments arguments = more;
        const std::vector<std::array<std::string, 2>> usual{
            {"--listen", "127.0.0.1:" + port_},
            {"--output", output()},
            {"--report", path("received.json").string()},
            {"--status", path("status.json").string()},
            {"--grid", "40"},
            {"--idle-timeout", "1"}};
        add_defaults(usual, arguments);
        receiver_.emplace(ELLICAST_RECV, arguments);
        REQUIRE(receiver_->await_err("listening on "));
    }
    /// Starts a sender; the first of `arguments` are models.
    void start_sender(const Arguments& arguments) {
        Arguments all = arguments;
        const std::vector<std::array<std::string, 2>> usual{{"--to", "127.0.0.1:" + port_},
                                                            {"--candidates", "400"},
                                                            {"--refine", "off"},
                                                            {"--ellipsoids", "60"},
                                                            {"--cache", path("cache").string()},
                                                            {"--report", path("sent.json")}};
        add_defaults(usual, all);
        sender_.emplace(ELLICAST_SEND, all);
    }
    /// Starts one that takes about 2 s for a round of the ring, and waits for a part of it.
    void start_slow_sender(const Arguments& more, std::chrono::milliseconds part = 700ms) {
        Arguments arguments{ring(), "--rate", "150k"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        start_sender(arguments);
        REQUIRE(sender_->await_err("datagrams a round"));
        std::this_thread::sleep_for(part);
    }
    void send(const Arguments& arguments) {
        start_sender(arguments);
        const int code = sender_->wait();
        INFO(sender_->err());
        REQUIRE(code == 0);
    }

    ChildProcess& sender() { return *sender_; }
    ChildProcess& receiver() { return *receiver_; }
    [[nodiscard]] json received() const {
        return json::parse(tests::read_file(path("received.json")));
    }
    [[nodiscard]] json sent() const { return json::parse(tests::read_file(path("sent.json"))); }
    /// Waits until the receiver has seen all that the sender sent to its end.
    void await_all_received() const {
        REQUIRE(tests::eventually([&] {
            const json status = json::parse(tests::read_file(path("status.json")), nullptr, false);
            return !status.is_discarded() &&
                   status["datagrams"]["received"] == sent()["sending"]["datagrams"]["sent"];
        }));
    }
    [[nodiscard]] common::MeshTopology topology() const { return topology_of(output()); }
    static common::MeshTopology topology_of(const std::filesystem::path& file) {
        return common::analyse_topology(common::read_model(file));
    }

  private:
    tests::TemporaryDirectory directory_;
    std::string port_ = std::to_string(tests::free_port());
    std::optional<ChildProcess> receiver_;
    std::optional<ChildProcess> sender_;
};

std::set<Bits> positions_of(const std::filesystem::path& path) {
    std::set<Bits> positions;
    for (const Eigen::Vector3d& p : common::read_model(path).positions) {
        positions.insert(
            {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
    return positions;
}

/// The exit code is that of a result, and says what the report says of the topology.
void check_kept(Pair& pair) {
    const int code = pair.receiver().wait();
    CAPTURE(pair.receiver().err());
    REQUIRE((code == 0 || code == 4));
    CHECK((code == 0) == pair.received()["mesh"]["topology_as_promised"].get<bool>());
    const common::MeshTopology topology = pair.topology();
    CHECK(topology.closed);
    CHECK(topology.manifold);
}

}  // namespace

TEST_CASE("without loss a ring crosses and is there bit for bit") {
    Pair pair;
    pair.listen({"--reference", pair.ring()});
    pair.send({pair.ring()});
    REQUIRE(pair.receiver().wait() == 0);
    const json received = pair.received();
    CAPTURE(received.dump(1));
    CHECK(received["ends_by"] == "complete");
    CHECK(received["object"]["id_verified"] == true);
    CHECK(received["object"]["name"] == "ring");
    CHECK(received["datagrams"]["lost"] == 0);
    CHECK(received["vertices"]["in_mesh"] == 1800);
    CHECK(received["mesh"]["genus"] == 1);
    CHECK(received["quality"]["rms"].get<double>() < 2e-3);
    CHECK(positions_of(pair.output()) == positions_of(pair.ring()));
    CHECK(pair.topology().genus() == 1);
}

TEST_CASE("what the sender drops on purpose, the receiver counts as lost") {
    Pair pair;
    pair.listen();
    pair.send({pair.ring(), "--drop", "0.3", "--loss-seed", "2"});
    REQUIRE(pair.receiver().wait() == 0);
    const json counts = pair.received()["datagrams"];
    const json sent = pair.sent()["sending"]["datagrams"];
    CHECK(sent["dropped_by_simulation"] > 0);
    CHECK(counts["lost"] == sent["dropped_by_simulation"]);
    CHECK(counts["received"] == sent["sent"]);
    CHECK(pair.received()["vertices"]["received"] < 1800);
    CHECK(pair.topology().genus() == 1);
}

TEST_CASE("ellipsoids alone make a closed ring") {
    Pair pair;
    pair.listen();
    pair.send({pair.ring(), "--drop-vertices", "1"});
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(pair.received()["vertices"]["received"] == 0);
    CHECK(pair.received()["ellipsoids"]["received"] == pair.received()["ellipsoids"]["expected"]);
    CHECK(pair.topology().closed);
    CHECK(pair.topology().manifold);
    CHECK(pair.topology().genus() == 1);
}

TEST_CASE("damage, copies and another order at once do no harm that rounds do not mend") {
    Pair pair;
    pair.listen({"--until", "complete"});
    pair.start_sender({pair.ring(), "--corrupt", "0.2", "--duplicate", "0.3", "--reorder", "0.3",
                       "--rounds", "forever"});
    REQUIRE(pair.receiver().wait() == 0);
    const json received = pair.received();
    CHECK(received["ends_by"] == "complete");
    CHECK(received["object"]["id_verified"] == true);
    CHECK(received["datagrams"]["malformed"] > 0);
    CHECK(received["datagrams"]["duplicate"] > 0);
    CHECK(received["datagrams"]["reordered"] > 0);
    CHECK(received["records"]["conflicting"] == 0);
    CHECK(received["others"]["groups"] == 0);
    CHECK(positions_of(pair.output()) == positions_of(pair.ring()));
}

TEST_CASE("losses simulated by the receiver are counted like those on the way") {
    Pair pair;
    pair.listen({"--drop", "0.3", "--loss-seed", "2"});
    pair.send({pair.ring()});
    check_kept(pair);
    const json counts = pair.received()["datagrams"];
    const json sent = pair.sent()["sending"]["datagrams"];
    CHECK(counts["lost"] > 0);
    CHECK(counts["received"].get<int>() + counts["lost"].get<int>() == sent["sent"]);
}

TEST_CASE("Ctrl-C in the middle of a round keeps what was received") {
    Pair pair;
    pair.listen({"--until", GENERATE("forever", "end")});
    pair.start_slow_sender({});
    pair.receiver().send_signal(SIGINT);
    check_kept(pair);
    const json received = pair.received();
    CHECK(received["ends_by"] == "interrupted");
    CHECK(received["vertices"]["received"] > 0);
    CHECK(received["vertices"]["received"] < received["vertices"]["expected"]);
    pair.sender().send_signal(SIGINT);
    pair.sender().wait();
}

TEST_CASE("whoever joins late is complete a round later") {
    Pair pair;
    pair.start_slow_sender({"--rounds", "3"});
    pair.listen();
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(pair.received()["ends_by"] == "complete");
    CHECK(pair.received()["object"]["id_verified"] == true);
    // What went before is not a loss, as far as the stream's mean pace can tell.
    CHECK(pair.received()["datagrams"]["lost"] <= 2);
    CHECK(positions_of(pair.output()) == positions_of(pair.ring()));
}

TEST_CASE("a sender that dies leaves what it had sent") {
    Pair pair;
    pair.listen();
    pair.start_slow_sender({});
    pair.sender().send_signal(SIGKILL);
    pair.sender().wait();
    check_kept(pair);
    const json received = pair.received();
    CHECK(received["ends_by"] == "idle");
    CHECK(received["vertices"]["received"] > 0);
    CHECK(received["vertices"]["received"] < 1800);
    CHECK(received["datagrams"]["lost"] > 0);  // the rest of the round was announced
}

TEST_CASE("a sender that starts again is heard to its end") {
    Pair pair;
    pair.listen({"--idle-timeout", "30"});  // a slow host takes a while to start one
    pair.start_slow_sender({});
    pair.sender().send_signal(SIGKILL);
    pair.sender().wait();
    pair.send({pair.ring()});
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(pair.received()["ends_by"] == "complete");
    CHECK(pair.received()["object"]["id_verified"] == true);
    CHECK(positions_of(pair.output()) == positions_of(pair.ring()));
}

TEST_CASE("of two models in a stream one is shown, whole and not mixed") {
    Pair pair;
    SECTION("until it is complete") {
        pair.listen();
        pair.send({pair.ball(), pair.ring()});
        REQUIRE(pair.receiver().wait() == 0);
        CHECK(pair.received()["object"]["name"] == "ball");
        CHECK(pair.received()["object"]["id_verified"] == true);
    }
    SECTION("the richer one, when all is heard") {
        pair.listen({"--until", "forever"});
        pair.send({pair.ball(), pair.ring()});
        pair.await_all_received();
        pair.receiver().send_signal(SIGINT);
        REQUIRE(pair.receiver().wait() == 0);
        const json received = pair.received();
        CHECK(received["object"]["name"] == "ring");
        CHECK(received["object"]["id_verified"] == true);
        CHECK(received["others"]["groups"] == 1);
        CHECK(received["others"]["datagrams"] > 0);
        CHECK(positions_of(pair.output()) == positions_of(pair.ring()));
    }
}

TEST_CASE("both reports hold every key that is promised") {
    Pair pair;
    pair.listen({"--reference", pair.ring()});
    pair.send({pair.ring()});
    REQUIRE(pair.receiver().wait() == 0);
    const json received = pair.received();
    const std::vector<std::pair<const char*, Arguments>> promised{
        {"datagrams",
         {"received", "lost", "duplicate", "reordered", "malformed", "kernel_dropped", "bytes"}},
        {"ellipsoids", {"received", "expected"}},
        {"vertices", {"received", "expected", "in_mesh"}},
        {"mesh",
         {"vertices", "faces", "components", "genus", "closed", "manifold",
          "topology_as_promised"}},
        {"quality",
         {"rms", "mean", "max", "rms_to_reference", "rms_from_reference", "normal_deg"}}};
    for (const auto& [part, keys] : promised) {
        CAPTURE(part);
        for (const std::string& key : keys) {
            CAPTURE(key);
            CHECK(received[part].contains(key));
        }
    }
    CHECK(received["not_inserted"].is_array());
    CHECK(received["seconds"].size() >= 3);
    for (const auto& [stage, seconds] : received["seconds"].items()) {
        CAPTURE(stage);
        CHECK(seconds["wall"].is_number());
        CHECK(seconds["cpu"].is_number());
    }
    CHECK(pair.sent().contains("sending"));
}

TEST_CASE("a topology that cannot hold exits 4, and the mesh is closed all the same") {
    Pair pair;
    pair.listen();
    // Two ellipsoids are no ring.
    pair.send({pair.ring(), "--ellipsoids", "2", "--drop-vertices", "1"});
    CHECK(pair.receiver().wait() == 4);
    const json received = pair.received();
    CAPTURE(received.dump(1));
    CHECK(received["ellipsoids"]["received"] == 2);
    CHECK(received["mesh"]["topology_as_promised"] == false);
    CHECK(received["mesh"]["judged"] == true);
    CHECK(pair.topology().closed);
    CHECK(pair.topology().manifold);
}

TEST_CASE("every stage's mesh is there and closed") {
    Pair pair;
    pair.listen({"--stages", pair.path("stages").string()});
    pair.send({pair.ring(), "--drop", "0.2"});
    check_kept(pair);
    for (const char* stage : {"1-ellipsoids", "2-marching-cubes", "3-halfway", "4-final"}) {
        CAPTURE(stage);
        const auto topology =
            Pair::topology_of(pair.path("stages") / (std::string(stage) + ".ply"));
        CHECK(topology.closed);
        CHECK(topology.manifold);
    }
    CHECK(tests::read_file(pair.path("stages") / "4-final.ply") == tests::read_file(pair.output()));
}

TEST_CASE("live meshes are there before the end, closed, and change nothing of the result") {
    Pair pair;
    pair.listen();
    pair.send({pair.ring(), "--rate", "150k"});
    REQUIRE(pair.receiver().wait() == 0);
    const std::string without = tests::read_file(pair.output());
    CHECK(pair.received()["live"].is_null());

    pair.listen({"--live", pair.path("live.ply").string(), "--live-stages",
                 pair.path("series").string(), "--update-interval", "0.2", "--until", "forever",
                 "--idle-timeout", "60"});
    // Time enough for two meshes on whatever machine, with sanitizers too.
    pair.start_slow_sender({"--rounds", "forever"});
    const std::filesystem::path second = pair.path("series") / "00002.ply";
    for (int n = 0; n < 300 && !std::filesystem::exists(second); ++n) {
        std::this_thread::sleep_for(100ms);
    }
    REQUIRE(std::filesystem::exists(second));
    CHECK(Pair::topology_of(pair.path("live.ply")).closed);
    REQUIRE(tests::eventually([&] {
        return json::parse(tests::read_file(pair.path("status.json")))["pages"][0]["complete"] ==
               true;
    }));
    pair.receiver().send_signal(SIGINT);
    REQUIRE(pair.receiver().wait() == 0);
    pair.sender().send_signal(SIGINT);
    REQUIRE(pair.sender().wait() == 0);
    CHECK(tests::read_file(pair.output()) == without);
    CHECK(tests::read_file(pair.path("live.ply")) == without);

    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(pair.path("series"))) {
        CHECK(Pair::topology_of(entry.path()).closed);
        ++files;
    }
    const json live = pair.received()["live"];
    CHECK(files > 1);
    CHECK(live["updates"].get<std::size_t>() <= files);
    CHECK(live["first_shape_ms"].get<double>() <= live["last"]["ms"].get<double>());
}

TEST_CASE("an interval of zero makes no live mesh") {
    Pair pair;
    pair.listen({"--live", pair.path("live.ply").string(), "--update-interval", "0"});
    pair.send({pair.ring()});
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(pair.received()["live"].is_null());
    CHECK_FALSE(std::filesystem::exists(pair.path("live.ply")));
}

TEST_CASE("option --until says when it is enough") {
    Pair pair;
    SECTION("complete: rounds go on until nothing is missing") {
        pair.listen({"--until", "complete"});
        pair.start_sender({pair.ring(), "--drop", "0.5", "--rounds", "forever"});
        REQUIRE(pair.receiver().wait() == 0);
        CHECK(pair.received()["ends_by"] == "complete");
    }
    SECTION("end: what is missing at the stream's end stays missing") {
        pair.listen({"--until", "end", "--idle-timeout", "20"});
        // A seed under which some vertex is lost twice and the last datagram arrives.
        pair.send({pair.ring(), "--drop", "0.3", "--rounds", "2", "--loss-seed", "2"});
        check_kept(pair);
        CHECK(pair.received()["ends_by"] == "stream_end");
    }
    SECTION("round: one round and no more, of a carousel without end") {
        pair.listen({"--until", "round", "--drop", "0.3", "--idle-timeout", "20"});
        pair.start_sender({pair.ring(), "--rounds", "forever", "--rate", "2M"});
        check_kept(pair);
        CHECK(pair.received()["ends_by"] == "round");
        CHECK(pair.received()["vertices"]["received"] < 1800);
        pair.sender().send_signal(SIGINT);
        CHECK(pair.sender().wait() == 0);
    }
    SECTION("forever: only Ctrl-C ends it") {
        pair.listen({"--until", "forever", "--idle-timeout", "0.1"});
        pair.send({pair.ring()});
        pair.await_all_received();
        pair.receiver().send_signal(SIGINT);
        REQUIRE(pair.receiver().wait() == 0);
        CHECK(pair.received()["ends_by"] == "interrupted");
        CHECK(pair.received()["object"]["complete"] == true);
    }
}

TEST_CASE("a directory as output gets a file named after the model") {
    Pair pair;
    pair.listen({"--output", pair.path("new").string() + "/"});
    pair.send({pair.ball()});
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(positions_of(pair.path("new") / "ball.ply") == positions_of(pair.ball()));
    CHECK(pair.received()["output"] == (pair.path("new") / "ball.ply").string());
}
