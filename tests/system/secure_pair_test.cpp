// tests/system/secure_pair_test.cpp: both real programs with keys, and strangers on the way.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/key_file.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "protocol/secured_datagram.hpp"
#include "sender/datagram_security.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using nlohmann::json;
using tests::ChildProcess;
using Arguments = std::vector<std::string>;
using Bytes = std::vector<std::uint8_t>;

namespace {

constexpr std::size_t kVertices = 1800;

sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
}

/// Stands between sender and receiver: what the sender sends goes through `meddle`, which gives
/// what the receiver gets instead.
class Relay {
  public:
    using Meddle = std::function<std::vector<Bytes>(const Bytes&)>;

    Relay(std::uint16_t receiver, Meddle meddle)
        : meddle_(std::move(meddle)), socket_(::socket(AF_INET, SOCK_DGRAM, 0)), to_(receiver) {
        sockaddr_in any = loopback(0);
        socklen_t length = sizeof(any);
        REQUIRE(::bind(socket_, reinterpret_cast<sockaddr*>(&any), length) == 0);
        REQUIRE(::getsockname(socket_, reinterpret_cast<sockaddr*>(&any), &length) == 0);
        port_ = ntohs(any.sin_port);
        thread_ = std::thread([this] { run(); });
    }
    ~Relay() {
        stopping_ = true;
        thread_.join();
        ::close(socket_);
    }
    Relay(const Relay&) = delete;
    Relay& operator=(const Relay&) = delete;
    [[nodiscard]] std::uint16_t port() const { return port_; }

  private:
    void run() {
        const sockaddr_in receiver = loopback(to_);
        Bytes buffer(1 << 16);
        while (!stopping_) {
            pollfd ready{socket_, POLLIN, 0};
            if (::poll(&ready, 1, 50) <= 0) continue;
            const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), 0);
            if (size < 0) continue;
            for (const Bytes& out : meddle_({buffer.begin(), buffer.begin() + size})) {
                ::sendto(socket_, out.data(), out.size(), 0,
                         reinterpret_cast<const sockaddr*>(&receiver), sizeof(receiver));
            }
        }
    }

    Meddle meddle_;
    int socket_;
    std::uint16_t to_;
    std::uint16_t port_ = 0;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

/// A folder with a ring and keys, and the two programs.
class SecurePair {
  public:
    SecurePair() {
        common::write_ply(path("ring.ply"), tests::torus(1.0, 0.4, 60, 30));
        common::write_signing_key(path("key"), common::SigningKey::random(), false);
        common::write_signing_key(path("other"), common::SigningKey::random(), false);
        common::write_shared_key(path("psk"), common::SharedKey::random(), false);
        common::write_shared_key(path("psk2"), common::SharedKey::random(), false);
    }
    [[nodiscard]] std::string path(const std::string& name) const {
        return (directory_.path() / name).string();
    }
    /// Starts the receiver and waits until it listens.
    void listen(Arguments more) {
        const Arguments usual{"--listen",       "127.0.0.1:0",
                              "--output",       path("out.ply"),
                              "--report",       path("received.json"),
                              "--status",       path("status.json"),
                              "--grid",         "40",
                              "--idle-timeout", "1"};
        more.insert(more.end(), usual.begin(), usual.end());
        receiver_.emplace(ELLICAST_RECV, more);
        REQUIRE(receiver_->await_err("listening on "));
        const std::string text = receiver_->err();
        const std::size_t line = text.find("listening on ");
        const std::size_t colon = text.find_last_of(':', text.find('\n', line));
        port_ = static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1)));
    }
    void send(Arguments more, std::optional<std::uint16_t> port = std::nullopt) {
        const Arguments usual{path("ring.ply"),
                              "--to",
                              "127.0.0.1:" + std::to_string(port.value_or(port_)),
                              "--candidates",
                              "400",
                              "--refine",
                              "off",
                              "--ellipsoids",
                              "60",
                              "--cache",
                              path("cache"),
                              "--report",
                              path("sent.json")};
        more.insert(more.end(), usual.begin(), usual.end());
        ChildProcess sender(ELLICAST_SEND, more);
        const int code = sender.wait();
        INFO(sender.err());
        REQUIRE(code == 0);
    }
    [[nodiscard]] std::uint16_t port() const { return port_; }
    ChildProcess& receiver() { return *receiver_; }
    [[nodiscard]] json received() const {
        return json::parse(tests::read_file(path("received.json")));
    }
    [[nodiscard]] json sent() const { return json::parse(tests::read_file(path("sent.json"))); }
    /// What the receiver says while it runs; discarded before it says anything.
    [[nodiscard]] json status() const {
        return json::parse(tests::read_file(path("status.json")), nullptr, false);
    }
    [[nodiscard]] std::string public_key(const char* name = "key.pub") const {
        return tests::read_file(path(name)).substr(0, 64);
    }
    void require_closed_ring() const {
        const auto topology = common::analyse_topology(common::read_model(path("out.ply")));
        CHECK(topology.closed);
        CHECK(topology.manifold);
        CHECK(topology.genus() == 1);
    }

  private:
    tests::TemporaryDirectory directory_;
    std::optional<ChildProcess> receiver_;
    std::uint16_t port_ = 0;
};

struct Outcome {
    int code;
    std::string out;
    std::string err;
};

Outcome run(const char* program, const Arguments& arguments) {
    ChildProcess process(program, arguments);
    const int code = process.wait();
    return {code, process.out(), process.err()};
}

}  // namespace

TEST_CASE("signed, sealed, or both, a ring crosses whole and is known to be the sender's") {
    const bool sealed = GENERATE(false, true);
    const bool is_signed = GENERATE(false, true);
    if (!sealed && !is_signed) return;
    SecurePair pair;
    Arguments receive;
    Arguments send;
    if (is_signed) {
        receive.insert(receive.end(), {"--verify", pair.path("key.pub")});
        send.insert(send.end(), {"--sign", pair.path("key")});
    }
    if (sealed) {
        receive.insert(receive.end(), {"--psk", pair.path("psk")});
        send.insert(send.end(), {"--psk", pair.path("psk")});
    }
    pair.listen(receive);
    pair.send(send);
    REQUIRE(pair.receiver().wait() == 0);
    const json received = pair.received();
    CAPTURE(received.dump(1));
    CHECK(received["ends_by"] == "complete");
    CHECK(received["object"]["id_verified"] == true);
    CHECK(received["vertices"]["in_mesh"] == kVertices);
    CHECK(received["datagrams"]["refused"] == 0);
    CHECK(received["authenticity"]["signed"] == is_signed);
    CHECK(received["authenticity"]["sealed"] == sealed);
    if (is_signed) CHECK(received["authenticity"]["verified_by"] == pair.public_key());
    CHECK(pair.sent()["sending"]["security"]["sealed"] == sealed);
    CHECK(pair.sent()["sending"]["security"]["signed"] == is_signed);
    CHECK(pair.sent()["sending"]["datagrams"]["bytes"] == received["datagrams"]["bytes"]);
    pair.require_closed_ring();
}

TEST_CASE("a signed and sealed stream with 30 % lost is counted and rebuilt like any other") {
    SecurePair pair;
    pair.listen({"--verify", pair.public_key(), "--psk", pair.path("psk")});
    pair.send({"--sign", pair.path("key"), "--psk", pair.path("psk"), "--drop", "0.3",
               "--loss-seed", "2"});
    REQUIRE(pair.receiver().wait() == 0);
    const json received = pair.received();
    CHECK(received["datagrams"]["lost"] ==
          pair.sent()["sending"]["datagrams"]["dropped_by_simulation"]);
    CHECK(received["datagrams"]["lost"] > 0);
    CHECK(received["vertices"]["received"] < kVertices);
    CHECK(received["authenticity"]["verified_by"] == pair.public_key());
    pair.require_closed_ring();
}

TEST_CASE("damage on the way is refused by signature or tag, and rounds mend it") {
    SecurePair pair;
    pair.listen({"--verify", pair.public_key(), "--psk", pair.path("psk"), "--until", "complete"});
    pair.send({"--sign", pair.path("key"), "--psk", pair.path("psk"), "--corrupt", "0.3",
               "--rounds", "12"});
    REQUIRE(pair.receiver().wait() == 0);
    const json received = pair.received();
    CHECK(received["ends_by"] == "complete");
    CHECK(received["object"]["id_verified"] == true);
    CHECK(received["datagrams"]["refused"].get<int>() > 0);
    CHECK(received["records"]["conflicting"] == 0);
    CHECK(received["others"]["groups"] == 0);
}

TEST_CASE("forgers who see the stream and know its session get nothing in") {
    SecurePair pair;
    pair.listen({"--verify", pair.public_key()});
    sender::StreamKeys wrong;
    wrong.sign = common::read_signing_key(pair.path("other"));
    std::optional<sender::DatagramSecurity> forger;
    std::atomic<std::size_t> seen{0};  // the relay counts on its own thread
    // Every real datagram is lost with probability 0.3, and comes among five forged ones.
    Relay relay(pair.port(), [&](const Bytes& real) {
        const auto view = protocol::read_secured(real);
        if (!view) return std::vector<Bytes>{};
        if (!forger) forger.emplace(wrong, view->session, view->security.session_start_us);
        Bytes clear = protocol::make_clear(*view, view->parts.sections);
        Bytes moved = real;  // a bit of some record
        moved.at(real.size() - 100) ^= 1;
        Bytes renumbered = real;
        renumbered[3] ^= 1;
        Bytes resigned = forger->secure(clear, 0);
        Bytes claimed = resigned;  // with the id of the right key
        std::copy(view->security.key.begin(), view->security.key.end(), claimed.begin() + 105);
        std::vector<Bytes> out{clear, moved, renumbered, resigned, claimed};
        if (seen++ % 10 >= 3) out.insert(out.begin() + 2, real);
        return out;
    });
    pair.send({"--sign", pair.path("key"), "--rate", "3M"}, relay.port());
    const int code = pair.receiver().wait();
    INFO(pair.receiver().err());
    REQUIRE(code == 0);
    const json received = pair.received();
    CAPTURE(received["datagrams"].dump(1), seen.load());
    const auto sent = pair.sent()["sending"]["datagrams"]["sent"].get<std::size_t>();
    CHECK(seen == sent);
    const json& by = received["datagrams"]["refused_by"];
    CHECK(by["not_signed"] == sent);
    CHECK(by["unknown_key"] == sent);
    CHECK(by["bad_signature"] == 3 * sent);
    CHECK(received["datagrams"]["received"].get<std::size_t>() +
              received["datagrams"]["lost"].get<std::size_t>() ==
          sent);
    CHECK(received["records"]["conflicting"] == 0);
    CHECK(received["others"]["groups"] == 0);
    CHECK(received["authenticity"]["verified_by"] == pair.public_key());
    pair.require_closed_ring();
}

TEST_CASE("without keys the receiver takes a signed stream, and says that it is unverified") {
    SecurePair pair;
    pair.listen({});
    pair.send({"--sign", pair.path("key")});
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(pair.received()["authenticity"]["signed"] == true);
    CHECK(pair.received()["authenticity"]["verified_by"].is_null());
    CHECK(pair.receiver().err().find("without --verify") != std::string::npos);
}

TEST_CASE("what the keys do not admit leaves nothing, and the report says why") {
    SecurePair pair;
    const auto [receive, send, why] =
        GENERATE(table<std::vector<const char*>, std::vector<const char*>, const char*>(
            {{{"--verify", "key.pub"}, {}, "not_signed"},
             {{"--verify", "other.pub"}, {"--sign", "key"}, "unknown_key"},
             {{"--psk", "psk"}, {}, "not_sealed"},
             {{"--psk", "psk2"}, {"--psk", "psk"}, "bad_tag"},
             {{}, {"--psk", "psk"}, "no_key"}}));
    const auto with_paths = [&](const std::vector<const char*>& words) {
        Arguments arguments(words.begin(), words.end());
        if (!arguments.empty()) arguments[1] = pair.path(arguments[1]);
        return arguments;
    };
    pair.listen(with_paths(receive));
    pair.send(with_paths(send));
    CHECK(tests::eventually([&] {
        const json status = pair.status();
        return !status.is_discarded() && status["datagrams"]["refused_by"][why] ==
                                             pair.sent()["sending"]["datagrams"]["sent"];
    }));
    pair.receiver().send_signal(SIGINT);
    CHECK(pair.receiver().wait() == 3);
    const json received = pair.received();
    CHECK(received["object"].is_null());
    CHECK(received["datagrams"]["refused_by"][why] == pair.sent()["sending"]["datagrams"]["sent"]);
    CHECK(pair.receiver().err().find(why) != std::string::npos);
}

TEST_CASE("a recording of an earlier session is refused by a receiver that remembers") {
    SecurePair pair;
    const Arguments listening{"--verify", pair.public_key(), "--state", pair.path("starts")};
    std::vector<Bytes> recording;
    {
        pair.listen(listening);
        Relay relay(pair.port(), [&](const Bytes& real) {
            recording.push_back(real);
            return std::vector<Bytes>{real};
        });
        pair.send({"--sign", pair.path("key")}, relay.port());
        REQUIRE(pair.receiver().wait() == 0);
    }
    pair.listen(listening);
    pair.send({"--sign", pair.path("key")});
    REQUIRE(pair.receiver().wait() == 0);
    CHECK(pair.received()["datagrams"]["refused"] == 0);
    const std::string starts = tests::read_file(pair.path("starts"));
    CHECK(starts.find(pair.public_key()) != std::string::npos);

    // The recording goes out again from where a newer session was heard since.
    const auto replay = [&] {
        Relay player(pair.port(), [&](const Bytes&) { return recording; });
        const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
        const sockaddr_in to = loopback(player.port());
        ::sendto(socket, "x", 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to));
        ::close(socket);
        return pair.receiver().wait();
    };
    Arguments brief = listening;
    brief.insert(brief.end(), {"--wait", "3"});
    pair.listen(brief);
    CHECK(replay() == 3);
    CHECK(pair.received()["datagrams"]["refused_by"]["replayed"] == recording.size());
    CHECK(tests::read_file(pair.path("starts")) == starts);

    SECTION("one that does not remember believes it") {
        pair.listen({"--verify", pair.public_key()});
        CHECK(replay() == 0);
    }
    SECTION("a damaged memory is told, and serves for what it still has") {
        std::ofstream(pair.path("starts")) << "ellicast session starts 1\nrubbish\n";
        pair.listen(listening);
        CHECK(replay() == 0);
        CHECK(pair.receiver().err().find("line 2 is damaged") != std::string::npos);
        CHECK(pair.receiver().err().find(pair.path("starts")) != std::string::npos);
        CHECK(tests::read_file(pair.path("starts")).find(pair.public_key()) != std::string::npos);
    }
}

TEST_CASE("option --max-age refuses recordings by the clock, and warns when that is all there is") {
    SecurePair pair;
    std::vector<Bytes> recording;
    pair.listen({"--verify", pair.public_key(), "--max-age", "60"});
    {
        Relay relay(pair.port(), [&](const Bytes& real) {
            recording.push_back(real);
            return std::vector<Bytes>{real};
        });
        pair.send({"--sign", pair.path("key")}, relay.port());
    }
    REQUIRE(pair.receiver().wait() == 0);
    pair.listen({"--verify", pair.public_key(), "--max-age", "0.5", "--wait", "3"});
    std::this_thread::sleep_for(700ms);
    {
        Relay player(pair.port(), [&](const Bytes&) { return recording; });
        const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
        const sockaddr_in to = loopback(player.port());
        ::sendto(socket, "x", 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to));
        ::close(socket);
        CHECK(pair.receiver().wait() == 3);
    }
    CHECK(pair.received()["datagrams"]["refused_by"]["out_of_date"] == recording.size());
    CHECK(pair.receiver().err().find("refused by --max-age") != std::string::npos);
}

TEST_CASE("the key command makes keys that the pair takes, and keeps those there are") {
    const tests::TemporaryDirectory folder;
    const std::string key = (folder.path() / "studio").string();
    const Outcome made = run(ELLICAST_SEND, {"key", "--output", key});
    REQUIRE(made.code == 0);
    CHECK(made.out == tests::read_file(key + ".pub"));
    CHECK(made.out.size() == 65);
    CHECK(common::read_signing_key(key).public_key() == common::read_public_key(key + ".pub"));
    struct stat status {};
    REQUIRE(::stat(key.c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0600);

    const std::string before = tests::read_file(key);
    const Outcome again = run(ELLICAST_SEND, {"key", "--output", key});
    CHECK(again.code == 2);
    CHECK(again.err.find("'" + key + "': exists already") != std::string::npos);
    CHECK(tests::read_file(key) == before);
    CHECK(run(ELLICAST_SEND, {"key", "--output", key, "--force"}).code == 0);
    CHECK(tests::read_file(key) != before);

    const std::string shared = (folder.path() / "team").string();
    CHECK(run(ELLICAST_SEND, {"key", "--shared", "--output", shared}).code == 0);
    CHECK(common::read_shared_key(shared).bytes() != common::SharedKey({}).bytes());
    CHECK(run(ELLICAST_SEND, {"key"}).code == 2);
    CHECK(run(ELLICAST_SEND, {"key", "--help"}).code == 0);
}

TEST_CASE("bad keys and contradictory options end in one line that names them") {
    SecurePair pair;
    const auto check = [](const char* program, const Arguments& arguments,
                          const Arguments& expected) {
        const Outcome outcome = run(program, arguments);
        CAPTURE(outcome.err);
        CHECK(outcome.code == 2);
        CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
        for (const std::string& part : expected) {
            CAPTURE(part);
            CHECK(outcome.err.find(part) != std::string::npos);
        }
    };
    const auto send = [&](const Arguments& more, const Arguments& expected) {
        Arguments arguments{pair.path("ring.ply"), "--to", "127.0.0.1:9"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        check(ELLICAST_SEND, arguments, expected);
    };
    const auto receive = [&](const Arguments& more, const Arguments& expected) {
        Arguments arguments{"--listen", "127.0.0.1:0", "--output", pair.path("out.ply")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        check(ELLICAST_RECV, arguments, expected);
    };
    send({"--sign", pair.path("none")}, {pair.path("none"), "No such file"});
    send({"--sign", pair.path("key.pub")}, {pair.path("key.pub"), "no private key"});
    send({"--sign", pair.path("ring.ply")}, {pair.path("ring.ply"), "128 hex digits"});
    send({"--psk", pair.path("key")}, {pair.path("key"), "64 hex digits"});
    send({"--sign", pair.path("key"), "--session", "0011223344556677"}, {"--session", "random"});
    ::chmod(pair.path("key").c_str(), 0644);
    send({"--sign", pair.path("key")}, {pair.path("key"), "everybody can read", "chmod 600"});

    receive({"--verify", pair.path("other")}, {pair.path("other"), "private key"});
    receive({"--verify", "abc"}, {"'abc'", "No such file"});
    receive({"--psk", pair.path("none")}, {pair.path("none"), "No such file"});
    receive({"--state", pair.path("starts")}, {"--state", "--verify"});
    receive({"--max-age", "5"}, {"--max-age", "--verify"});
    receive({"--verify", pair.public_key(), "--max-age", "-1"}, {"--max-age"});
    receive({"--verify", pair.public_key(), "--unverified-queue", "0"}, {"--unverified-queue"});
    receive({"--verify", pair.public_key(), "--state", pair.path("no/folder")},
            {pair.path("no/folder")});
}
