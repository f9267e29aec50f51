// tests/system/rtp_capture_test.cpp: what a tool that knows RTP, and nothing of us, sees of a
// stream.
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
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
using tests::ChildProcess;
using tests::MadeNetwork;
using tests::ProgramOutcome;
using tests::run_program;
using Words = std::vector<std::string>;

namespace {

constexpr std::uint16_t kFirstSequence = 65'000;  // wraps around after 536 datagrams
constexpr const char* kSsrc = "0x00000007";
constexpr int kLossPercent = 30;

/// One line of tshark's table.
struct RtpStream {
    std::uint64_t packets = 0;
    std::int64_t lost = 0;
    bool operator==(const RtpStream&) const = default;
};
std::ostream& operator<<(std::ostream& out, const RtpStream& stream) {
    return out << stream.packets << " packets, " << stream.lost << " lost";
}

/// All streams that tshark lists; ours must be the only one.
std::vector<RtpStream> streams_in(const std::string& capture) {
    const ProgramOutcome shown = run_program(
        {"tshark", "-r", capture, "-d", "udp.port==5004,rtp", "-q", "-z", "rtp,streams"});
    std::vector<RtpStream> streams;
    std::istringstream lines(shown.out);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t ssrc = line.find(" 0x");
        if (ssrc == std::string::npos) continue;
        CHECK(line.substr(ssrc + 1, 10) == kSsrc);
        // Behind the SSRC: payload type, packets, lost (share).
        std::istringstream words(line.substr(ssrc + 11));
        std::string type;
        RtpStream stream;
        words >> type >> stream.packets >> stream.lost;
        REQUIRE(words);
        streams.push_back(stream);
    }
    return streams;
}

std::optional<RtpStream> stream_in(const std::string& capture) {
    const std::vector<RtpStream> streams = streams_in(capture);
    if (streams.empty()) return std::nullopt;
    CHECK(streams.size() == 1);
    return streams.front();
}

/// Quicker than tshark; 0 while the file cannot be read.
std::uint64_t packets_in(const std::string& capture) {
    const ProgramOutcome counted = run_program({"capinfos", "-T", "-r", "-M", "-c", capture});
    const std::size_t tab = counted.out.find_last_of('\t');
    return tab == std::string::npos ? 0 : std::strtoull(counted.out.c_str() + tab, nullptr, 10);
}

/// dumpcap on one host's interface, into a file.
class Capture {
  public:
    Capture(const std::string& space, std::string file) : file_(std::move(file)) {
        dumpcap_ = std::make_unique<ChildProcess>(
            "/usr/bin/env",
            MadeNetwork::inside(space, {"dumpcap", "-i", "near", "-f", "udp dst port 5004", "-B",
                                        "16", "-w", file_}));
        started_ = dumpcap_->await_err("File: ");
    }
    [[nodiscard]] bool started() const { return started_; }
    [[nodiscard]] std::string err() const { return dumpcap_->err(); }

    /// Ends once so many packets are in the file, or after a long time; what tshark makes of it.
    RtpStream finish(std::uint64_t packets) {
        for (int k = 0; k < 100; ++k) {
            if (packets_in(file_) >= packets) break;
            std::this_thread::sleep_for(200ms);
        }
        dumpcap_->send_signal(SIGINT);
        CHECK(dumpcap_->wait() == 0);
        INFO(err());
        CHECK_THAT(err(), Catch::Contains("received/dropped on interface 'near': " +
                                          std::to_string(packets) + "/0 "));
        return stream_in(file_).value_or(RtpStream{});
    }

  private:
    std::string file_;
    std::unique_ptr<ChildProcess> dumpcap_;
    bool started_ = false;
};

void check_stream(MadeNetwork& network, const std::string& to) {
    const tests::TemporaryDirectory directory;
    const auto path = [&](const char* name) { return (directory.path() / name).string(); };
    common::write_ply(path("ring.ply"), tests::torus(1.0, 0.4, 180, 90));
    Capture near_sender(network.sender(), path("sent.pcapng"));
    Capture near_receiver(network.receiver(), path("received.pcapng"));
    INFO(near_sender.err() << near_receiver.err());
    REQUIRE(near_sender.started());
    REQUIRE(near_receiver.started());
    ChildProcess receiver(
        "/usr/bin/env",
        MadeNetwork::inside(network.receiver(), {ELLICAST_RECV, "--listen", to, "--interface",
                                                 "near", "--output", path("out.ply"), "--report",
                                                 path("received.json"), "--threads", "1"}));
    REQUIRE(receiver.await_err("listening on "));
    const std::uint64_t dropped_before = network.dropped_on_the_way();
    const ProgramOutcome sending =
        run_program(MadeNetwork::inside(network.sender(), {ELLICAST_SEND,
                                                           path("ring.ply"),
                                                           "--to",
                                                           to,
                                                           "--interface",
                                                           "near",
                                                           "--datagram",
                                                           "576",
                                                           "--rounds",
                                                           "2",
                                                           "--rate",
                                                           "10M",
                                                           "--refine",
                                                           "off",
                                                           "--candidates",
                                                           "200",
                                                           "--ssrc",
                                                           "7",
                                                           "--first-sequence",
                                                           std::to_string(kFirstSequence),
                                                           "--report",
                                                           path("sent.json")}));
    INFO(sending.err);
    REQUIRE(sending.code == 0);
    REQUIRE(receiver.wait() == 0);

    const json report = json::parse(tests::read_file(path("sent.json")));
    const auto sent = report["sending"]["datagrams"]["sent"].get<std::uint64_t>();
    const std::uint64_t dropped = network.dropped_on_the_way() - dropped_before;
    REQUIRE(kFirstSequence + sent > 65'536);
    REQUIRE(dropped > 0);
    const RtpStream left = near_sender.finish(sent);
    const RtpStream arrived = near_receiver.finish(sent - dropped);
    WARN(to << ": " << sent << " sent, " << dropped
            << " dropped by the kernel's rule; tshark at the "
            << "sender: " << left << "; at the receiver: " << arrived);
    CHECK(left == RtpStream{sent, 0});
    CHECK(arrived == RtpStream{sent - dropped, static_cast<std::int64_t>(dropped)});
    const json counts = json::parse(tests::read_file(path("received.json")))["datagrams"];
    CHECK(counts["received"] == sent - dropped);
    CHECK(counts["lost"] == dropped);
}

}  // namespace

TEST_CASE("tshark counts the datagrams that were sent and those that the kernel lost") {
    if (run_program({"tshark", "--version"}).code != 0) {
        WARN("SKIPPED: there is no tshark");
        return;
    }
    MadeNetwork network;
    if (!network.missing().empty()) {
        WARN("SKIPPED: " << network.missing());
        return;
    }
    if (!network.lose_on_the_way(kLossPercent, kFirstSequence)) {
        WARN("SKIPPED: nft's numgen does not work on bridges here");
        return;
    }
    SECTION("over IPv4") {
        check_stream(network, "239.255.77.1:5004");
    }
    SECTION("over IPv6") {
        check_stream(network, "[ff15::77]:5004");
    }
}
