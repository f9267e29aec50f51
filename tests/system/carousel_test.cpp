// tests/system/carousel_test.cpp: a carousel of three pages, real programs over loopback.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/random.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using nlohmann::json;
using tests::ChildProcess;
using tests::eventually;
using Arguments = std::vector<std::string>;
namespace fs = std::filesystem;

namespace {

const std::vector<std::string> kNames{"ball", "egg", "ring"};

common::MeshTopology topology_of(const fs::path& file) {
    return common::analyse_topology(common::read_model(file));
}

/// Three small models, and the programs on one port. Few candidates and a coarse grid keep them
/// quick; a round takes about a second at the usual rate.
class Place {
  public:
    Place() {
        fs::create_directory(path("models"));
        common::write_ply(model("ball"), tests::icosphere(3));             // 642 vertices
        common::write_ply(model("ring"), tests::torus(1.0, 0.4, 60, 30));  // 1800, genus 1
        common::TriangleMesh egg = tests::icosphere(3);
        for (auto& p : egg.positions) p.z() *= 1.7;
        common::write_ply(model("egg"), egg);
    }
    [[nodiscard]] fs::path path(const std::string& name) const { return directory_.path() / name; }
    [[nodiscard]] std::string model(const std::string& name) const {
        return (path("models") / (name + ".ply")).string();
    }
    /// Written aside and put in its place at once, as editors do.
    void put(const std::string& name, const common::TriangleMesh& mesh) const {
        common::write_ply(path("next.ply"), mesh);
        fs::rename(path("next.ply"), model(name));
    }
    [[nodiscard]] json read(const std::string& name) const {
        return json::parse(tests::read_file(path(name)), nullptr, false);
    }

    std::unique_ptr<ChildProcess> sender(const Arguments& more = {}, const char* rate = "700k") {
        Arguments all{model("ball"), model("egg"), model("ring")};
        if (std::find(more.begin(), more.end(), "--rounds") == more.end()) {
            all.insert(all.end(), {"--rounds", "forever"});
        }
        const Arguments usual{"--to",         "127.0.0.1:" + port_,
                              "--rate",       rate,
                              "--candidates", "400",
                              "--ellipsoids", "60",
                              "--refine",     "off",
                              "--cache",      path("cache").string(),
                              "--status",     path("sending.json").string(),
                              "--report",     path("sent.json").string()};
        all.insert(all.end(), usual.begin(), usual.end());
        all.insert(all.end(), more.begin(), more.end());
        auto process = std::make_unique<ChildProcess>(ELLICAST_SEND, all);
        REQUIRE(process->await_err("ring.ply: 1800 vertices"));
        return process;
    }
    std::unique_ptr<ChildProcess> receiver(const Arguments& more, const std::string& name = "out") {
        Arguments all{"--listen", "127.0.0.1:" + port_, "--grid", "32"};
        const auto is_given = [&](const char* option) {
            return std::find(more.begin(), more.end(), option) != more.end();
        };
        const std::vector<std::array<std::string, 2>> usual{
            {"--output", path(name).string() + "/"},
            {"--report", path(name + ".json").string()},
            {"--status", path(name + "-status.json").string()},
            {"--idle-timeout", "3"}};
        for (const auto& [option, value] : usual) {
            if (!is_given(option.c_str())) all.insert(all.end(), {option, value});
        }
        all.insert(all.end(), more.begin(), more.end());
        auto process = std::make_unique<ChildProcess>(ELLICAST_RECV, all);
        REQUIRE(process->await_err("listening on "));
        return process;
    }
    /// Makes a key, and names it to the sender.
    [[nodiscard]] Arguments signing() const {
        const std::string key = path("key").string();
        ChildProcess process(ELLICAST_SEND, {"key", "--force", "--output", key});
        REQUIRE(process.wait() == 0);
        return {"--sign", key};
    }
    /// All pages are there, closed, and of the right genus.
    void check_pages(const std::string& name = "out") const {
        const json report = read(name + ".json");
        CAPTURE(report.dump(1));
        REQUIRE(report["pages"].size() == 3);
        for (const json& page : report["pages"]) {
            CHECK(page["mesh"]["closed"] == true);
            CHECK(page["mesh"]["manifold"] == true);
            CHECK(page["mesh"]["topology_as_promised"] == true);
        }
        for (const std::string& page : kNames) {
            const auto topology = topology_of(path(name) / (page + ".ply"));
            CHECK(topology.closed);
            CHECK(topology.manifold);
            CHECK(topology.genus() == (page == "ring" ? 1 : 0));
        }
    }
    [[nodiscard]] const std::string& port() const { return port_; }

  private:
    tests::TemporaryDirectory directory_;
    std::string port_ = std::to_string(tests::free_port());
};

void stop(ChildProcess& process) {
    process.send_signal(SIGINT);
    CHECK(process.wait() == 0);
}

/// Datagrams of a round, and those up to the middle of its last page, as a sender says.
struct Round {
    std::size_t all = 0;
    std::size_t part = 0;
};
Round round_of(Place& place, const Arguments& more, const std::string& rate) {
    const auto sender = place.sender(more, rate.c_str());
    REQUIRE(eventually([&] { return !place.read("sending.json").is_discarded(); }));
    const json pages = place.read("sending.json")["pages"];
    stop(*sender);
    fs::remove(place.path("sending.json"));
    const std::size_t last = pages[2]["datagrams"];
    const std::size_t before =
        pages[0]["datagrams"].get<std::size_t>() + pages[1]["datagrams"].get<std::size_t>();
    return {before + last, before + last / 2};
}

/// Starts a sender, kills it, starts another: the first one is heard until it has sent `part` of a
/// round, the second one for the round but for its first `missed` datagrams, and no longer.
void restart_sender(Place& place, const Round& round, std::size_t missed, const Arguments& more,
                    const std::string& rate) {
    constexpr std::size_t kMany = 100'000;  // datagrams before a trace begins anew
    const auto with_loss = [&](const std::string& trace) {
        std::ofstream(place.path("trace")) << trace << std::string(kMany, '1');
        Arguments all{"--loss", "trace:" + place.path("trace").string()};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    };
    auto sender = place.sender(with_loss(std::string(round.part, '0')), rate.c_str());
    REQUIRE(eventually([&] {
        const json status = place.read("out-status.json");
        return !status.is_discarded() && status["datagrams"]["received"] == round.part;
    }));
    sender->send_signal(SIGKILL);
    sender->wait();
    Arguments second = with_loss(std::string(missed, '1') + std::string(round.all - missed, '0'));
    second.insert(second.end(), {"--rounds", "2"});  // of which the second is lost
    sender = place.sender(second, rate.c_str());
    CHECK(sender->wait() == 0);
}

}  // namespace

TEST_CASE("three pages arrive through 30 % loss, each under its name") {
    Place place;
    const auto sender = place.sender();
    const auto receiver = place.receiver({"--until", "complete", "--drop", "0.3"});
    INFO(receiver->err());
    CHECK(receiver->wait() == 0);
    place.check_pages();
    const json report = place.read("out.json");
    for (const json& page : report["pages"]) CHECK(page["id_verified"] == true);
    CHECK(std::distance(fs::directory_iterator(place.path("out")), {}) == 3);
    stop(*sender);
    CHECK(place.read("sent.json")["models"][2]["version"] == 1);
}

TEST_CASE("what is on air is listed within a few seconds, at a rate that takes longer for a page") {
    Place place;
    const auto sender = place.sender({}, "60k");
    const auto start = std::chrono::steady_clock::now();
    const auto receiver = place.receiver({"--list"});
    CHECK(receiver->wait() == 0);
    CHECK(std::chrono::steady_clock::now() - start < 10s);
    const json list = place.read("out.json");
    REQUIRE(list["pages"].size() == 3);
    for (std::size_t k = 0; k < 3; ++k) CHECK(list["pages"][k]["name"] == kNames[k]);
    CHECK(list["pages"][2]["genus"] == 1);
    CHECK(list["pages"][2]["vertices"] == 1800);
    CHECK(receiver->out().find("ring") != std::string::npos);
    CHECK_FALSE(fs::exists(place.path("out") / "ring.ply"));
    stop(*sender);
}

TEST_CASE("nothing on air is said so") {
    Place place;
    const auto receiver = place.receiver({"--list", "--wait", "0.3"});
    CHECK(receiver->wait() == 3);
    CHECK(receiver->err().find("nothing received") != std::string::npos);
}

TEST_CASE("one page is chosen into a file, others into a directory") {
    Place place;
    const auto sender = place.sender();
    const auto one = place.receiver({"--page", "egg", "--output", place.path("egg.ply").string(),
                                     "--report", place.path("one.json").string()});
    CHECK(one->wait() == 0);
    const auto two = place.receiver({"--page", "egg", "--page", "ring"}, "two");
    CHECK(two->wait() == 0);
    CHECK(topology_of(place.path("egg.ply")).genus() == 0);
    CHECK(place.read("one.json")["object"]["name"] == "egg");
    CHECK(place.read("one.json")["object"]["id_verified"] == true);
    CHECK(place.read("two.json")["pages"].size() == 2);
    CHECK_FALSE(fs::exists(place.path("two") / "ball.ply"));
    stop(*sender);
}

TEST_CASE("a page that changes is a new version at whoever listens, a broken file is none") {
    Place place;
    const auto sender = place.sender();
    const auto receiver = place.receiver({"--until", "forever", "--drop", "0.2"});
    const auto version_of = [&](const std::string& name) {
        const json status = place.read("out-status.json");
        if (status.is_discarded()) return 0;
        for (const json& page : status["pages"]) {
            const bool written = !page["output"].is_null();
            if (page["name"] == name && written) return page["version"].get<int>();
        }
        return 0;
    };
    REQUIRE(eventually([&] { return version_of("ball") == 1 && version_of("egg") == 1; }));

    std::ofstream(place.model("egg")) << "ply\nno model at all\n";
    REQUIRE(sender->await_err("the page stays as it is"));

    // A ball becomes a ring; nothing else does.
    place.put("ball", tests::torus(1.0, 0.3, 50, 20));
    REQUIRE(sender->await_err("version 2 is on air"));
    REQUIRE(eventually([&] {
        return fs::exists(place.path("out") / "ball.ply") &&
               topology_of(place.path("out") / "ball.ply").genus() == 1;
    }));
    // A hang-up has all read again, to no effect where nothing changed.
    sender->send_signal(SIGHUP);
    REQUIRE(sender->await_err("ring.ply: the object is the same as before"));
    REQUIRE(eventually([&] { return place.read("sending.json")["pages"][0]["version"] == 2; }));
    CHECK(place.read("sending.json")["pages"][1]["version"] == 1);
    receiver->send_signal(SIGTERM);
    CHECK(receiver->wait() == 0);
    stop(*sender);
    const json report = place.read("out.json");
    for (const json& page : report["pages"]) {
        CAPTURE(page.dump());
        CHECK(page["version"] == (page["name"] == "ball" ? 2 : 1));
        CHECK(page["mesh"]["closed"] == true);
        CHECK(page["mesh"]["topology_as_promised"] == true);
        CHECK(page["mesh"]["genus"] == (page["name"] == "egg" ? 0 : 1));
    }
    CHECK(place.read("sent.json")["models"][0]["version"] == 2);
}

TEST_CASE("whoever joins at a random moment has all pages a round later, and a shape at once") {
    Place place;
    const auto sender = place.sender({}, "2M");
    common::Random random(static_cast<std::uint64_t>(std::stoul(place.port())));
    for (int join = 0; join < 4; ++join) {
        std::this_thread::sleep_for(std::chrono::milliseconds(random.below(700)));
        const std::string name = "join" + std::to_string(join);
        const auto receiver = place.receiver({"--until", "complete", "--drop", "0.3", "--live",
                                              place.path(name + "-live").string() + "/"},
                                             name);
        CHECK(receiver->wait() == 0);
        place.check_pages(name);
        const json live = place.read(name + ".json")["live"];
        CHECK(live["updates"] > 0);
        for (const auto& file : fs::directory_iterator(place.path(name + "-live"))) {
            CHECK(topology_of(file.path()).closed);
        }
    }
    stop(*sender);
}

TEST_CASE("a sender that is killed and started again costs at most a round") {
    Place place;
    const bool with_key = GENERATE(false, true);
    CAPTURE(with_key);
    const Arguments signing = with_key ? place.signing() : Arguments{};
    Arguments receiving{"--until", "complete", "--idle-timeout", "30"};
    if (with_key) receiving.insert(receiving.end(), {"--verify", place.path("key.pub").string()});
    // One round of the second sender is heard: complete by then, or never.
    SECTION("of the second one") {
        const Round round = round_of(place, signing, "2M");
        const auto receiver = place.receiver(receiving);
        restart_sender(place, round, 0, signing, "2M");
        CHECK(receiver->wait() == 0);
    }
    SECTION("in which what the first one brought need not come again") {
        // Without a key that is so when the first one was silent for five seconds; the datagrams
        // that are missed take six. (Layouts depend on the rate.)
        const std::string rate = with_key ? "2M" : "57k";
        const Round round = round_of(place, signing, rate);
        const auto receiver = place.receiver(receiving);
        restart_sender(place, round, round.part, signing, rate);
        CHECK(receiver->wait() == 0);
    }
    CHECK(place.read("out.json")["ends_by"] == "complete");
    place.check_pages();
}

TEST_CASE("a receiver that is killed and started again leaves no half file, and begins anew") {
    Place place;
    const auto sender = place.sender({}, "3M");
    {
        const auto receiver = place.receiver({"--until", "forever"});
        REQUIRE(eventually([&] { return fs::exists(place.path("out") / "ring.ply"); }));
        receiver->send_signal(SIGKILL);
        receiver->wait();
    }
    for (const auto& file : fs::directory_iterator(place.path("out"))) {
        if (file.path().extension() == ".ply") CHECK(topology_of(file.path()).closed);
    }
    CHECK_FALSE(place.read("out-status.json").is_discarded());
    const auto again = place.receiver({"--until", "complete", "--drop", "0.3"});
    CHECK(again->wait() == 0);
    place.check_pages();
    stop(*sender);
}

TEST_CASE("SIGTERM lets the round end, but neither a second one nor Ctrl-C does") {
    Place place;
    const auto sender = place.sender({}, "300k");
    REQUIRE(eventually([&] {
        const json status = place.read("sending.json");
        return !status.is_discarded() && status["datagrams"]["sent"] > 3;
    }));
    sender->send_signal(SIGTERM);
    REQUIRE(sender->await_err("ending with round"));
    SECTION("alone") {
        CHECK(sender->wait() == 0);
        const json sent = place.read("sent.json");
        std::uint64_t in_a_round = 0;
        for (const json& model : sent["models"]) {
            in_a_round += model["datagrams"].get<std::uint64_t>();
        }
        CHECK(sent["sending"]["interrupted"] == true);
        CHECK(sent["sending"]["rounds"] >= 1);
        CHECK(sent["sending"]["datagrams"]["offered"] ==
              sent["sending"]["rounds"].get<std::uint64_t>() * in_a_round);
        CHECK(place.read("sending.json")["state"] == "ended");
    }
    SECTION("hurried") {
        sender->send_signal(GENERATE(SIGTERM, SIGINT));
        const auto start = std::chrono::steady_clock::now();
        CHECK(sender->wait() == 0);
        CHECK(std::chrono::steady_clock::now() - start < 2s);
        CHECK(place.read("sent.json")["sending"]["rounds"] == 0);
    }
}

TEST_CASE("a round that lasts longer than SIGTERM allows is cut") {
    Place place;
    const auto sender = place.sender({"--stop-timeout", "0.5"}, "20k");
    REQUIRE(eventually([&] { return fs::exists(place.path("sending.json")); }));
    sender->send_signal(SIGTERM);
    CHECK(sender->wait(10s) == 0);
    CHECK(place.read("sent.json")["sending"]["rounds"] == 0);
}

TEST_CASE("a service manager hears when the programs are ready, and when they end") {
    Place place;
    const std::string name = place.path("notify").string();
    const int manager = ::socket(AF_UNIX, SOCK_DGRAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path, sizeof(address.sun_path) - 1);
    REQUIRE(::bind(manager, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0);
    const auto hears = [&](const std::string& word) {
        return eventually([&] {
            std::array<char, 512> bytes{};
            const ssize_t size = ::recv(manager, bytes.data(), bytes.size(), MSG_DONTWAIT);
            const std::string text(bytes.data(), static_cast<std::size_t>(size < 0 ? 0 : size));
            return text.find(word) != std::string::npos;
        });
    };
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
    setenv("WATCHDOG_USEC", "400000", 1);
    const bool sends = GENERATE(true, false);
    const auto process = sends ? place.sender() : place.receiver({"--until", "forever"});
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    CHECK(hears("READY=1"));
    CHECK(hears("WATCHDOG=1"));
    process->send_signal(SIGINT);
    CHECK(hears("STOPPING=1"));
    CHECK(process->wait() == (sends ? 0 : 3));
    ::close(manager);
}

TEST_CASE("limits keep out what is too large, and say so") {
    Place place;
    const auto sender = place.sender({}, "3M");
    const auto receiver =
        place.receiver({"--max-vertices", "1000", "--page", "ball", "--page", "egg"});
    CHECK(receiver->wait() == 0);
    CHECK(place.read("out.json")["pages"].size() == 2);
    const auto small = place.receiver({"--max-name", "8", "--page", "ring"}, "small");
    CHECK(small->wait() == 0);
    stop(*sender);
    for (const Arguments& wrong : {Arguments{"--max-memory", "12"}, Arguments{"--max-pages", "0"},
                                   Arguments{"--max-name", "3"},
                                   Arguments{"--page", "a", "--page", "b", "--output", "x.ply"}}) {
        ChildProcess process(ELLICAST_RECV, wrong);
        CHECK(process.wait() == 2);
        CHECK(process.err().find(wrong[0] == "--page" ? "--output" : wrong[0]) !=
              std::string::npos);
    }
}
