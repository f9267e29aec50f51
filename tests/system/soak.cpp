// tests/system/soak.cpp: a carousel of three pages, one of which changes every few seconds, and
// eight receivers that each lose 30 % in bursts, for so many minutes. See scripts/soak.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using nlohmann::json;
using tests::ChildProcess;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

namespace {

constexpr std::size_t kReceivers = 8;
constexpr auto kChangeInterval = 5s;
constexpr auto kLookInterval = 1s;
// Memory that is not given back at once: heaps of worker threads, tables that grow a step.
constexpr double kGrowth = 1.15;
constexpr long kSlackKilobytes = 8192;

sockaddr_in local(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
}

/// A bound loopback socket.
int bound_socket(std::uint16_t& port) {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = local(0);
    socklen_t length = sizeof(address);
    if (::bind(socket, reinterpret_cast<sockaddr*>(&address), length) != 0) std::exit(2);
    ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length);
    port = ntohs(address.sin_port);
    return socket;
}

/// One sender's datagrams to many: what a switch does with multicast.
class Fanout {
  public:
    explicit Fanout(std::vector<std::uint16_t> targets)
        : socket_(bound_socket(port_)), targets_(std::move(targets)), thread_([this] { run(); }) {
        const timeval patience{0, 200'000};
        ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    }
    ~Fanout() {
        stop_ = true;
        thread_.join();
        ::close(socket_);
    }
    Fanout(const Fanout&) = delete;
    Fanout& operator=(const Fanout&) = delete;
    [[nodiscard]] std::uint16_t port() const { return port_; }

  private:
    void run() {
        std::vector<std::uint8_t> bytes(1 << 16);
        while (!stop_) {
            const ssize_t size = ::recv(socket_, bytes.data(), bytes.size(), 0);
            if (size <= 0) continue;
            for (const std::uint16_t target : targets_) {
                const sockaddr_in address = local(target);
                (void)::sendto(socket_, bytes.data(), static_cast<std::size_t>(size), 0,
                               reinterpret_cast<const sockaddr*>(&address), sizeof(address));
            }
        }
    }
    std::uint16_t port_ = 0;
    int socket_;
    std::vector<std::uint16_t> targets_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// What a process holds, watched over two stretches of time.
struct Holdings {
    std::string name;
    pid_t pid = 0;
    std::array<long, 2> kilobytes{0, 0};      // the most of each stretch
    std::array<long, 2> descriptors{-1, -1};  // the fewest

    void look(std::size_t stretch) {
        std::ifstream status("/proc/" + std::to_string(pid) + "/status");
        for (std::string line; std::getline(status, line);) {
            if (line.rfind("VmRSS:", 0) != 0) continue;
            const long now = std::strtol(line.c_str() + 6, nullptr, 10);
            kilobytes[stretch] = std::max(kilobytes[stretch], now);
        }
        std::error_code error;
        const fs::directory_iterator open("/proc/" + std::to_string(pid) + "/fd", error);
        const long count = static_cast<long>(std::distance(open, {}));
        long& fewest = descriptors[stretch];
        fewest = fewest < 0 ? count : std::min(fewest, count);
    }
    [[nodiscard]] bool flat() const {
        const auto before = static_cast<double>(kilobytes[0]);
        return static_cast<double>(kilobytes[1]) <= kGrowth * before + kSlackKilobytes &&
               descriptors[1] <= descriptors[0];
    }
};

int failures = 0;

void expect(bool is_so, const std::string& what) {
    if (is_so) return;
    ++failures;
    std::printf("FAILED: %s\n", what.c_str());
}

/// Every mesh that a receiver has finished so far.
std::size_t check_status(const fs::path& file) {
    if (!fs::exists(file)) return 0;
    const json status = json::parse(tests::read_file(file), nullptr, false);
    expect(!status.is_discarded(), file.string() + " is no JSON");
    if (status.is_discarded()) return 0;
    std::size_t written = 0;
    for (const json& page : status["pages"]) {
        if (page["output"].is_null()) continue;
        ++written;
        expect(page["valid"] == true, file.string() + ": " + page.dump());
    }
    return written;
}

class Soak {
  public:
    Soak() {
        fs::create_directory(path("models"));
        common::write_ply(path("models/ring.ply"), tests::torus(1.0, 0.4, 60, 30));
        common::write_ply(path("models/ball.ply"), tests::icosphere(3));
        change();
        std::vector<std::uint16_t> ports;
        for (std::size_t k = 0; k < kReceivers; ++k) {
            std::uint16_t port = 0;
            ::close(bound_socket(port));
            ports.push_back(port);
            start_receiver(k, port);
        }
        fanout_ = std::make_unique<Fanout>(ports);
        start_sender();
    }

    void run(std::chrono::seconds duration) {
        const auto start = Clock::now();
        auto next_change = start + kChangeInterval;
        std::size_t written = 0;
        while (Clock::now() - start < duration) {
            std::this_thread::sleep_for(kLookInterval);
            if (Clock::now() >= next_change) {
                next_change += kChangeInterval;
                change();
            }
            // The first third is for warming up, the second and the last are compared.
            const double share = std::chrono::duration<double>(Clock::now() - start) / duration;
            for (Holdings& holdings : holdings_) {
                if (share > 0.34) holdings.look(share > 0.67 ? 1 : 0);
            }
            written = 0;
            for (std::size_t k = 0; k < kReceivers; ++k) {
                written += check_status(path("status-" + std::to_string(k)));
            }
        }
        expect(written == 3 * kReceivers, std::to_string(written) + " pages are written, not " +
                                              std::to_string(3 * kReceivers));
    }

    void finish() {
        for (const Holdings& h : holdings_) {
            std::printf("%-12s %6ld -> %6ld kB, %2ld -> %2ld descriptors\n", h.name.c_str(),
                        h.kilobytes[0], h.kilobytes[1], h.descriptors[0], h.descriptors[1]);
            expect(h.flat(), h.name + " grows");
        }
        for (const auto& receiver : receivers_) receiver->send_signal(SIGINT);
        for (std::size_t k = 0; k < kReceivers; ++k) check_report(k);
        sender_->send_signal(SIGTERM);
        expect(sender_->wait() == 0, "sender: " + sender_->err());
        const json sent = json::parse(tests::read_file(path("sent")), nullptr, false);
        std::printf("%u changes, %lu datagrams\n", changes_,
                    sent["sending"]["datagrams"]["sent"].get<unsigned long>());
        expect(sent["models"][0]["version"] >= changes_ / 2, "too few versions were on air");
    }

  private:
    [[nodiscard]] fs::path path(const std::string& name) const { return directory_.path() / name; }

    /// The first page becomes another one, in one step.
    void change() {
        const double thickness = 0.25 + 0.02 * (changes_ % 8);
        common::write_ply(path("next.ply"), tests::torus(1.0, thickness, 50, 20));
        fs::rename(path("next.ply"), path("models/changing.ply"));
        ++changes_;
    }
    void start_receiver(std::size_t k, std::uint16_t port) {
        const std::string name = std::to_string(k);
        receivers_.push_back(std::make_unique<ChildProcess>(
            ELLICAST_RECV,
            std::vector<std::string>{
                "--listen", "127.0.0.1:" + std::to_string(port), "--until", "forever", "--output",
                path("pages-" + name).string() + "/", "--status", path("status-" + name).string(),
                "--report", path("report-" + name).string(),
                // 30 % in bursts of 20, and what else networks do.
                "--loss", "gilbert:0.0214,0.05", "--reorder", "0.02", "--duplicate", "0.02",
                "--corrupt", "0.01", "--loss-seed", std::to_string(k + 1), "--grid", "32",
                "--threads", "1", "--log-level", "warn"}));
        holdings_.push_back({.name = "receiver " + name, .pid = receivers_.back()->pid()});
    }
    void start_sender() {
        sender_ = std::make_unique<ChildProcess>(
            ELLICAST_SEND, std::vector<std::string>{path("models/changing.ply").string(),
                                                    path("models/ring.ply").string(),
                                                    path("models/ball.ply").string(),
                                                    "--to",
                                                    "127.0.0.1:" + std::to_string(fanout_->port()),
                                                    "--rounds",
                                                    "forever",
                                                    "--rate",
                                                    "1500k",
                                                    "--candidates",
                                                    "400",
                                                    "--ellipsoids",
                                                    "60",
                                                    "--refine",
                                                    "off",
                                                    "--threads",
                                                    "1",
                                                    "--report",
                                                    path("sent").string(),
                                                    "--log-level",
                                                    "warn"});
        holdings_.push_back({.name = "sender", .pid = sender_->pid()});
    }
    void check_report(std::size_t k) {
        const std::string name = "receiver " + std::to_string(k);
        const int code = receivers_[k]->wait();
        expect(code == 0,
               name + " ends with " + std::to_string(code) + ": " + receivers_[k]->err());
        const json report =
            json::parse(tests::read_file(path("report-" + std::to_string(k))), nullptr, false);
        expect(!report.is_discarded() && report["pages"].size() == 3, name + " lacks pages");
        if (report.is_discarded()) return;
        for (const json& page : report["pages"]) {
            expect(page["mesh"]["closed"] == true && page["mesh"]["manifold"] == true,
                   name + ": " + page.dump());
        }
        const json& counts = report["datagrams"];
        const double loss = counts["loss_rate"];
        std::printf("%s: %.1f %% lost, runs of %.1f, %lu malformed\n", name.c_str(), 100 * loss,
                    counts["runs"]["mean"].get<double>(), counts["malformed"].get<unsigned long>());
        expect(loss > 0.15 && loss < 0.45, name + " loses another share");
    }

    tests::TemporaryDirectory directory_;
    std::vector<std::unique_ptr<ChildProcess>> receivers_;
    std::unique_ptr<Fanout> fanout_;
    std::unique_ptr<ChildProcess> sender_;
    std::vector<Holdings> holdings_;
    unsigned changes_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
    const double minutes = argc > 1 ? std::strtod(argv[1], nullptr) : 20.0;
    if (argc > 2 || !(minutes > 0)) {
        std::fprintf(stderr, "usage: soak [MINUTES]\n");
        return 2;
    }
    Soak soak;
    soak.run(std::chrono::seconds(static_cast<long>(60 * minutes)));
    soak.finish();
    std::printf("%s\n", failures == 0 ? "soak: all is well" : "soak: FAILED");
    return failures == 0 ? 0 : 1;
}
