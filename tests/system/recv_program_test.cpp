// tests/system/recv_program_test.cpp: the real ellicast-recv, fed over loopback.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/random.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/datagrams.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using tests::ChildProcess;
using tests::Datagram;
using tests::made_datagrams;
using tests::made_sphere;
using tests::MadeObject;
using tests::MadeStream;
using Arguments = std::vector<std::string>;

namespace {

/// A UDP socket that sends to a port of this host.
class Sender {
  public:
    explicit Sender(std::uint16_t port, bool v6 = false)
        : socket_(socket(v6 ? AF_INET6 : AF_INET, SOCK_DGRAM, 0)) {
        REQUIRE(socket_ >= 0);
        sockaddr_in6 to6{};
        to6.sin6_family = AF_INET6;
        to6.sin6_addr = in6addr_loopback;
        to6.sin6_port = htons(port);
        sockaddr_in to4{};
        to4.sin_family = AF_INET;
        to4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        to4.sin_port = htons(port);
        connected_ = v6 ? connect(socket_, reinterpret_cast<sockaddr*>(&to6), sizeof(to6)) == 0
                        : connect(socket_, reinterpret_cast<sockaddr*>(&to4), sizeof(to4)) == 0;
    }
    ~Sender() { close(socket_); }
    Sender(const Sender&) = delete;
    Sender& operator=(const Sender&) = delete;

    [[nodiscard]] bool connected() const { return connected_; }
    void send(const std::vector<Datagram>& datagrams,
              std::chrono::microseconds pause = 100us) const {
        for (const Datagram& datagram : datagrams) {
            ::send(socket_, datagram.data(), datagram.size(), 0);
            if (pause > 0us) std::this_thread::sleep_for(pause);
        }
    }

  private:
    int socket_;
    bool connected_ = false;
};

/// ellicast-recv in a directory of its own, listening on a free port. A coarse grid keeps it quick.
struct Receiver {
    explicit Receiver(Arguments more = {}, const std::string& listen = "127.0.0.1:0",
                      const std::string& output_name = "out.ply") {
        output = directory.path().string() + "/" + output_name;
        Arguments arguments{"--listen", listen,        "--output",       output,
                            "--report", report_path(), "--idle-timeout", "0.5"};
        if (std::find(more.begin(), more.end(), "--grid") == more.end()) {
            arguments.insert(arguments.end(), {"--grid", "24"});
        }
        arguments.insert(arguments.end(), more.begin(), more.end());
        process.emplace(ELLICAST_RECV, arguments);
    }
    std::uint16_t port() {
        REQUIRE(process->await_err("listening on "));
        const std::string text = process->err();
        const std::size_t line = text.find("listening on ");
        const std::size_t colon = text.find_last_of(':', text.find('\n', line));
        return static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1)));
    }
    [[nodiscard]] std::string report_path() const {
        return (directory.path() / "report.json").string();
    }
    [[nodiscard]] nlohmann::json report() const {
        return nlohmann::json::parse(tests::read_file(report_path()));
    }

    tests::TemporaryDirectory directory;
    std::string output;
    std::optional<ChildProcess> process;
};

struct Outcome {
    int code;
    std::string out;
    std::string err;
};

Outcome run(const Arguments& arguments) {
    ChildProcess process(ELLICAST_RECV, arguments);
    const int code = process.wait();
    return {code, process.out(), process.err()};
}

std::size_t lines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

bool holds(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

// Bits of float32 positions.
using Bits = std::array<float, 3>;
std::set<Bits> positions_of(const std::filesystem::path& path) {
    std::set<Bits> positions;
    for (const Eigen::Vector3d& p : common::read_model(path).positions) {
        positions.insert(
            {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
    return positions;
}

const MadeObject& sphere() {
    static const MadeObject made = made_sphere(1500, 20);
    return made;
}

}  // namespace

TEST_CASE("help and version end well and say what is asked") {
    const Outcome help = run({"--help"});
    CHECK(help.code == 0);
    CHECK(holds(help.out, "Examples:"));
    for (const char* option :
         {"--listen", "--until", "--idle-timeout", "--conceal", "--drop", "--config"}) {
        CHECK(holds(help.out, option));
    }
    const Outcome version = run({"--version"});
    CHECK(version.code == 0);
    CHECK(holds(version.out, "ellicast-recv 0."));
}

TEST_CASE("what the user got wrong is said in one line that names it, and exits 2") {
    const tests::TemporaryDirectory directory;
    const std::string file = (directory.path() / "garbage.ply").string();
    std::ofstream(file) << "no mesh\n";
    const std::string nowhere = (directory.path() / "missing" / "x.ply").string();
    const std::string below_file = file + "/x";
    const struct {
        Arguments arguments;
        std::string named;
    } wrong[] = {
        {{"--nonsense"}, "--nonsense"},
        {{"surplus"}, "surplus"},
        {{"--listen", "nonsense:port"}, "--listen"},
        {{"--listen", "127.0.0.1:70000"}, "--listen"},
        {{"--listen", "no-such-host.invalid:5004"}, "no-such-host.invalid"},
        {{"--listen", "192.0.2.1:5004"}, "192.0.2.1:5004"},
        {{"--sdp", nowhere}, nowhere},
        {{"--sdp", directory.path().string()}, directory.path().string()},
        {{"--sdp", file}, file + ": line 1: expected"},
        {{"--sdp", file, "--listen", ":5004"}, "--listen"},
        {{"--sdp", file, "--source", "10.0.0.1"}, "--source"},
        {{"--grid", "2"}, "--grid"},
        {{"--until", "tomorrow"}, "--until"},
        {{"--conceal", "maybe"}, "--conceal"},
        {{"--idle-timeout", "-1"}, "--idle-timeout"},
        {{"--idle-timeout", "nan"}, "--idle-timeout"},
        {{"--drop", "1.5"}, "--drop"},
        {{"--output", ""}, "--output"},
        {{"--output", nowhere}, nowhere},
        {{"--output", below_file + "/"}, below_file},
        {{"--report", nowhere}, nowhere},
        {{"--report", directory.path().string()}, directory.path().string()},
        {{"--stages", below_file}, below_file},
        {{"--reference", nowhere}, nowhere},
        {{"--reference", file}, file},
        {{"--config", nowhere}, nowhere},
    };
    for (const auto& [arguments, named] : wrong) {
        CAPTURE(arguments);
        Arguments all = arguments;
        if (arguments[0] != "--output") {
            all.insert(all.end(), {"--output", (directory.path() / "out.ply").string()});
        }
        const Outcome outcome = run(all);
        CAPTURE(outcome.err);
        CHECK(outcome.code == 2);
        CHECK(lines(outcome.err) == 1);
        CHECK(holds(outcome.err, named));
    }
}

TEST_CASE("a port in use exits 2 with a line that names it") {
    Receiver first({}, ":0");
    const std::string port = std::to_string(first.port());
    for (const std::string& listen : {":" + port, "127.0.0.1:" + port}) {
        const tests::TemporaryDirectory directory;
        const Outcome outcome =
            run({"--listen", listen, "--output", (directory.path() / "x.ply").string()});
        CHECK(outcome.code == 2);
        CHECK(holds(outcome.err, ":" + port));
        CHECK(holds(outcome.err, "in use"));
    }
}

TEST_CASE("nothing received exits 3 with a line, whoever ends it") {
    Receiver receiver(GENERATE(Arguments{}, Arguments{"--wait", "0.3"}));
    const auto port = receiver.port();
    const bool interrupts = GENERATE(true, false);
    if (interrupts) {
        Sender(port).send({Datagram(300, 0x80)});
        receiver.process->send_signal(SIGINT);
    } else {
        receiver.process->send_signal(SIGTERM);
    }
    CHECK(receiver.process->wait() == 3);
    CHECK(holds(receiver.process->err(), "nothing received"));
    CHECK_FALSE(std::filesystem::exists(receiver.output));
    const auto report = receiver.report();
    CHECK(report["object"].is_null());
    CHECK(report["mesh"].is_null());
    CHECK(report["datagrams"]["received"] == 0);
}

TEST_CASE("option --wait gives up by itself") {
    Receiver receiver({"--wait", "0.2"});
    CHECK(receiver.process->wait() == 3);
    CHECK(receiver.report()["ends_by"] == "waited");
}

TEST_CASE("a whole object arrives, bit for bit, and the report says so") {
    const tests::TemporaryDirectory models;
    const std::string reference = (models.path() / "reference.ply").string();
    {
        Receiver receiver;
        Sender(receiver.port()).send(made_datagrams(sphere()));
        REQUIRE(receiver.process->wait() == 0);
        std::filesystem::copy(receiver.output, reference);
    }
    Receiver receiver({"--reference", reference, "--stages", (models.path() / "steps").string()});
    const auto datagrams = made_datagrams(sphere());
    Sender(receiver.port()).send(datagrams);
    REQUIRE(receiver.process->wait() == 0);

    const std::set<Bits> got = positions_of(receiver.output);
    for (const auto& vertex : sphere().vertices) REQUIRE(got.count(vertex.position) == 1);
    const auto topology = common::analyse_topology(common::read_model(receiver.output));
    CHECK(topology.closed);
    CHECK(topology.manifold);
    CHECK(topology.genus() == 0);

    const auto report = receiver.report();
    CAPTURE(report.dump(2));
    CHECK(report["ends_by"] == "complete");
    CHECK(report["object"]["complete"] == true);
    CHECK(report["object"]["id_verified"] == true);
    CHECK(report["object"]["name"] == "made-sphere");
    CHECK(report["datagrams"]["received"] == datagrams.size());
    CHECK(report["datagrams"]["lost"] == 0);
    CHECK(report["datagrams"]["malformed"] == 0);
    CHECK(report["datagrams"]["kernel_dropped"] == 0);
    CHECK(report["ellipsoids"]["received"] == 20);
    CHECK(report["vertices"]["expected"] == 1500);
    CHECK(report["vertices"]["in_mesh"] == 1500);
    CHECK(report["not_inserted"].empty());
    CHECK(report["mesh"]["genus"] == 0);
    CHECK(report["mesh"]["closed"] == true);
    CHECK(report["mesh"]["topology_as_promised"] == true);
    CHECK(report["quality"]["rms"].get<double>() < 1e-6);
    CHECK(report["quality"].size() == 6);
    CHECK(report["seconds"].contains("receive"));
    for (const char* stage : {"1-ellipsoids", "2-marching-cubes", "3-halfway", "4-final"}) {
        CHECK(std::filesystem::exists(models.path() / "steps" / (std::string(stage) + ".ply")));
    }
    CHECK(holds(receiver.process->out(), "1500 of 1500 vertices"));
    CHECK(holds(receiver.process->out(), "distance to the reference"));
}

TEST_CASE("missing vertices are guessed and marked, unless that is off") {
    const bool off = GENERATE(false, true);
    Arguments arguments{"--drop-vertices", "0.5"};
    if (off) arguments.insert(arguments.end(), {"--conceal", "off"});
    Receiver receiver(arguments);
    Sender(receiver.port()).send(made_datagrams(sphere()));
    REQUIRE(receiver.process->wait() == 0);
    const auto report = receiver.report();
    CAPTURE(report.dump(1));
    CHECK(report["confidence"]["missing"].get<int>() > 0);
    CHECK((report["confidence"]["concealed"] > 0) == !off);
    CHECK(report["confidence"]["received"] == report["vertices"]["in_mesh"]);
    CHECK(report["confidence"]["largest_gap"]["radius"] > 0);
    CHECK(holds(receiver.process->out(), "vertices missing"));
    CHECK(holds(receiver.process->out(), "guessed") == !off);
    const std::string header = tests::read_file(receiver.output).substr(0, 600);
    CHECK(holds(header, "property uchar provenance"));
    CHECK(holds(header, "property float distance_to_received"));
    CHECK(holds(header, "property float confidence"));
}

TEST_CASE("a signal keeps what was received") {
    const int number = GENERATE(SIGINT, SIGTERM);
    Receiver receiver({"--until", "forever"});
    const auto datagrams = made_datagrams(sphere());
    Sender(receiver.port()).send({datagrams.begin(), datagrams.begin() + 9});
    receiver.process->send_signal(number);
    REQUIRE(receiver.process->wait() == 0);
    CHECK(receiver.report()["ends_by"] == "interrupted");
    CHECK(receiver.report()["datagrams"]["received"] == 9);
    CHECK(common::analyse_topology(common::read_model(receiver.output)).closed);
}

TEST_CASE("a signal while the result is made is forgiven once") {
    Receiver receiver({"--log-level", "debug", "--grid", "64"});
    Sender(receiver.port()).send(made_datagrams(sphere()));
    REQUIRE(receiver.process->await_err("stage coarse"));
    receiver.process->send_signal(SIGINT);
    REQUIRE(receiver.process->await_err("once more to abort"));
    SECTION("then all goes on") {
        CHECK(receiver.process->wait() == 0);
        CHECK(std::filesystem::exists(receiver.output));
    }
    SECTION("the second one aborts, and leaves no half file") {
        receiver.process->send_signal(SIGINT);
        CHECK(receiver.process->wait() == 128 + SIGINT);
        CHECK_FALSE(std::filesystem::exists(receiver.output));
    }
}

TEST_CASE("an interrupted reception does not forgive another signal") {
    Receiver receiver({"--log-level", "debug", "--grid", "64", "--until", "forever"});
    Sender(receiver.port()).send(made_datagrams(sphere()));
    receiver.process->send_signal(SIGINT);
    REQUIRE(receiver.process->await_err("stage coarse"));
    receiver.process->send_signal(SIGINT);
    CHECK(receiver.process->wait() == 128 + SIGINT);
}

TEST_CASE("quiet says nothing but what went wrong") {
    Receiver receiver({"--quiet", "--wait", "0.2"});
    CHECK(receiver.process->wait() == 3);
    CHECK(receiver.process->out().empty());
    CHECK(lines(receiver.process->err()) == 1);
}

TEST_CASE("garbage is counted by cause, and what came between is not lost") {
    Receiver receiver;
    const auto datagrams = made_datagrams(sphere());
    common::Random random(4);
    std::vector<Datagram> mixed;
    for (const Datagram& datagram : datagrams) {
        mixed.push_back(datagram);
        Datagram noise(random.below(1400));
        for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.next());
        mixed.push_back(noise);
        Datagram flipped = datagram;
        flipped[20 + random.below(flipped.size() - 20)] ^= 1;
        mixed.push_back(flipped);
        mixed.push_back(Datagram(datagram.begin(), datagram.begin() + 60));
    }
    Sender(receiver.port()).send(mixed);
    REQUIRE(receiver.process->wait() == 0);
    const auto report = receiver.report();
    CHECK(report["object"]["id_verified"] == true);
    // All that followed the completing datagram was never looked at.
    CHECK(report["datagrams"]["malformed"] == 3 * (datagrams.size() - 1));
    std::uint64_t sum = 0;
    for (const auto& [cause, count] : report["datagrams"]["malformed_by"].items()) {
        sum += count.get<std::uint64_t>();
    }
    CHECK(sum == report["datagrams"]["malformed"]);
    CHECK(report["datagrams"]["malformed_by"]["bad_checksum"] >= datagrams.size() / 2);
    CHECK(report["datagrams"]["malformed_by"]["too_short"] >= datagrams.size() - 1);
}

TEST_CASE("lost datagrams are counted, at the network's and at this end") {
    const auto datagrams = made_datagrams(sphere());
    SECTION("lost on the way, the first and the last of them too") {
        Receiver receiver;
        const auto port = receiver.port();
        std::this_thread::sleep_for(200ms);  // so that the beginning was surely listened for
        std::vector<Datagram> some(datagrams.begin() + 1, datagrams.end() - 2);
        some.erase(some.begin() + 4);
        Sender(port).send(some);
        receiver.process->wait();
        CHECK(receiver.report()["ends_by"] == "idle");
        CHECK(receiver.report()["datagrams"]["lost"] == 4);
    }
    SECTION("simulated here") {
        Receiver receiver({"--drop", "0.3", "--loss-seed", "5"});
        Sender(receiver.port()).send(datagrams);
        receiver.process->wait();
        const auto counts = receiver.report()["datagrams"];
        CHECK(counts["lost"] > 0);
        CHECK(counts["received"].get<std::size_t>() + counts["lost"].get<std::size_t>() ==
              datagrams.size());
    }
}

TEST_CASE("what the kernel had no room for is counted, apart from the network's loss") {
    // One round of an endless carousel, renumbered again and again (WIRE_FORMAT.md: round at 73).
    constexpr std::uint32_t kRounds = 4500;
    MadeStream stream;
    stream.rounds = 0;
    auto round = made_datagrams(sphere(), stream);
    const tests::TemporaryDirectory place;
    const std::string status = (place.path() / "status.json").string();
    Receiver receiver({"--until", "forever", "--status", status});
    const Sender sender(receiver.port());
    const auto seen = [](const nlohmann::json& counts) {
        return counts["received"].get<std::size_t>() - counts["duplicate"].get<std::size_t>() +
               counts["lost"].get<std::size_t>();
    };
    receiver.process->send_signal(SIGSTOP);
    std::uint16_t sequence = stream.first_sequence;
    for (std::uint32_t r = 0; r < kRounds; ++r) {
        for (Datagram& datagram : round) {
            for (std::size_t k = 0; k < 4; ++k) {
                datagram[73 + k] = static_cast<std::uint8_t>(r >> (8 * (3 - k)));
            }
            protocol::stamp(datagram, sequence++, 0);
        }
        sender.send(round, 0us);
    }
    receiver.process->send_signal(SIGCONT);
    // A copy of the last one tells how far the numbers went, once the queue has room for it.
    const std::size_t sent = kRounds * round.size();
    REQUIRE(tests::eventually([&] {
        sender.send({round.back()});
        const std::string text = tests::read_file(status);
        return !text.empty() && seen(nlohmann::json::parse(text)["datagrams"]) >= sent;
    }));
    receiver.process->send_signal(SIGINT);
    CHECK(receiver.process->wait() == 0);
    const auto counts = receiver.report()["datagrams"];
    CAPTURE(counts.dump(2));
    CHECK(counts["kernel_dropped"] > 0);
    CHECK(counts["lost_in_network"] == 0);
    CHECK(seen(counts) == sent);
    CHECK(holds(receiver.process->err(), "the kernel dropped"));
}

TEST_CASE("vertices without any ellipsoid exit 3 and say why") {
    Receiver receiver({"--drop-ellipsoids", "1"});
    Sender(receiver.port()).send(made_datagrams(sphere()));
    CHECK(receiver.process->wait() == 3);
    CHECK(holds(receiver.process->err(), "not a single ellipsoid"));
    CHECK_FALSE(std::filesystem::exists(receiver.output));
    CHECK(receiver.report()["vertices"]["received"] == 1500);
}

TEST_CASE("a topology that is not as promised exits 4, unless it was promised approximately") {
    MadeObject genus_two = sphere();
    genus_two.hint.euler_all = genus_two.hint.euler_largest = -2;
    genus_two.hint.approximate = GENERATE(false, true);
    identify(genus_two);
    Receiver receiver;
    Sender(receiver.port()).send(made_datagrams(genus_two));
    CHECK(receiver.process->wait() == (genus_two.hint.approximate ? 0 : 4));
    CHECK(receiver.report()["mesh"]["closed"] == true);
    CHECK(std::filesystem::exists(receiver.output));
}

TEST_CASE("a directory as output gets a file named after the model, and only inside") {
    MadeObject object = sphere();
    object.description.name = "../../.evil/..\\na me:1";
    Receiver receiver({}, "127.0.0.1:0", "new/");
    const std::filesystem::path directory = receiver.output;
    SECTION("by name") {
        Sender(receiver.port()).send(made_datagrams(object));
        CHECK(receiver.process->wait() == 0);
        CHECK(std::filesystem::exists(directory / "na_me_1.ply"));
    }
    SECTION("by id without a description") {
        MadeStream stream;
        stream.describe = false;
        Sender(receiver.port()).send(made_datagrams(object, stream));
        CHECK(receiver.process->wait() == 0);
        const std::string id = receiver.report()["object"]["id"];
        CHECK(receiver.report()["object"]["name"] == id);
        CHECK(std::filesystem::exists(directory / (id + ".ply")));
    }
}

TEST_CASE("the default address takes IPv4 and IPv6") {
    Receiver receiver({}, ":0");
    const auto port = receiver.port();
    const auto datagrams = made_datagrams(sphere());
    const Sender six(port, true);
    if (!six.connected()) {
        WARN("no IPv6 loopback here: only IPv4 is tried");
        Sender(port).send(datagrams);
    } else {
        six.send({datagrams.begin(), datagrams.begin() + 5});
        Sender(port).send(datagrams);
    }
    CHECK(receiver.process->wait() == 0);
    CHECK(receiver.report()["object"]["complete"] == true);
    CHECK(receiver.report()["others"]["groups"] == (six.connected() ? 1 : 0));
}

TEST_CASE("options come from a file too, and the command line wins") {
    const tests::TemporaryDirectory directory;
    const auto config = directory.path() / "recv.ini";
    std::ofstream(config) << "until=forever\nwait=0.2\ndrop=0.5\n";
    Receiver receiver({"--config", config.string(), "--until", "end"});
    CHECK(receiver.process->wait() == 3);
    std::ofstream(config) << "no-such-option=1\n";
    CHECK(run({"--config", config.string()}).code == 2);
}

TEST_CASE("two runs over the same datagrams write the same bytes, on any number of threads") {
    auto datagrams = made_datagrams(sphere());
    datagrams.erase(datagrams.begin() + 5, datagrams.begin() + 9);
    std::string first;
    for (const std::string threads : {"1", "3"}) {
        Receiver receiver({"--threads", threads});
        Sender(receiver.port()).send(datagrams);
        receiver.process->wait();
        const std::string bytes = tests::read_file(receiver.output);
        REQUIRE_FALSE(bytes.empty());
        if (first.empty()) first = bytes;
        CHECK(bytes == first);
        common::Random random(9);
        common::shuffle(datagrams, random);
        datagrams.push_back(datagrams.front());
    }
}
