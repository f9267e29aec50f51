// tests/tools/norm_file.cpp: a file to silent receivers of NORM [RFC 5740], the rival that needs no
// back channel either: parity goes out with the data, and nobody asks for more.
#include <normApi.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

// Reed-Solomon over bytes codes at most 255 segments together: the most parity there is.
constexpr std::uint16_t kBlock = 64;
constexpr std::uint16_t kParity = 190;
// What a datagram of 1200 bytes leaves beside NORM's header and the object's description.
constexpr std::uint16_t kSegment = 1168;
constexpr double kPayloadShare = 1200.0 / 1228.0;  // --rate counts IP and UDP headers
constexpr int kNever = 3;                          // exit code
constexpr std::uint32_t kBuffer = 64u << 20;

struct Options {
    std::string file;
    std::string group = "239.255.77.1";
    std::uint16_t port = 5004;
    std::string interface = "near";
    double rate = 10e6;
    bool repeat = false;
    double wait = 10;  // seconds
};

std::vector<char> bytes_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw std::runtime_error("cannot read '" + path + "'");
    return {std::istreambuf_iterator<char>(in), {}};
}

/// A NORM session, ready to be started.
class NormSession {
  public:
    NormSession(const Options& options, NormNodeId node) : instance_(NormCreateInstance()) {
        session_ = NormCreateSession(instance_, options.group.c_str(), options.port, node);
        if (session_ == NORM_SESSION_INVALID) {
            NormDestroyInstance(instance_);
            throw std::runtime_error("no session with " + options.group);
        }
        NormSetMulticastInterface(session_, options.interface.c_str());
    }
    ~NormSession() {
        NormDestroySession(session_);
        NormDestroyInstance(instance_);
    }
    NormSession(const NormSession&) = delete;
    NormSession& operator=(const NormSession&) = delete;

    [[nodiscard]] NormSessionHandle get() const { return session_; }
    NormEvent next_event() {
        NormEvent event{};
        if (!NormGetNextEvent(instance_, &event, true)) throw std::runtime_error("NORM ended");
        return event;
    }
    /// False when there is none until then.
    bool await_event(Clock::time_point until) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
        ::pollfd news{NormGetDescriptor(instance_), POLLIN, 0};
        return left > 0 && ::poll(&news, 1, static_cast<int>(left)) > 0;
    }

  private:
    NormInstanceHandle instance_;
    NormSessionHandle session_ = NORM_SESSION_INVALID;
};

int send(const Options& options) {
    const std::vector<char> bytes = bytes_of(options.file);
    NormSession norm(options, 1);
    NormSetTxOnly(norm.get(), true);
    NormSetCongestionControl(norm.get(), false);
    NormSetGrttProbingMode(norm.get(), NORM_PROBE_NONE);
    NormSetGrttEstimate(norm.get(), 0.001);
    NormSetTxRate(norm.get(), options.rate * kPayloadShare);
    if (!NormStartSender(norm.get(), NormGetRandomSessionId(), kBuffer, kSegment, kBlock,
                         kParity)) {
        throw std::runtime_error("NORM's sender does not start");
    }
    NormSetAutoParity(norm.get(), kParity);
    const auto enqueue = [&] {
        if (NormDataEnqueue(norm.get(), bytes.data(), static_cast<std::uint32_t>(bytes.size())) ==
            NORM_OBJECT_INVALID) {
            throw std::runtime_error("NORM does not take '" + options.file + "'");
        }
    };
    const auto start = Clock::now();
    enqueue();
    for (;;) {
        const NormEvent event = norm.next_event();
        if (event.type != NORM_TX_OBJECT_SENT) continue;
        if (!options.repeat) break;
        enqueue();
    }
    std::printf("{\"seconds\": %.4f}\n",
                std::chrono::duration<double>(Clock::now() - start).count());
    return 0;
}

/// Prints how long after the first datagram the file was whole; 3 when it never was.
int receive(const Options& options) {
    const std::vector<char> expected = bytes_of(options.file);
    NormSession norm(options, NORM_NODE_ANY);
    NormSetSilentReceiver(norm.get(), true);
    if (!NormStartReceiver(norm.get(), kBuffer)) {
        throw std::runtime_error("NORM's receiver does not start");
    }
    NormSetRxSocketBuffer(norm.get(), 8u << 20);
    std::fprintf(stderr, "listening on %s\n", options.group.c_str());
    Clock::time_point first{};
    const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(options.wait));
    while (norm.await_event(until)) {
        const NormEvent event = norm.next_event();
        if (event.type == NORM_REMOTE_SENDER_NEW) first = Clock::now();
        if (event.type != NORM_RX_OBJECT_COMPLETED) continue;
        const std::chrono::duration<double> whole = Clock::now() - first;
        const char* const data = NormDataAccessData(event.object);
        const bool intact =
            NormObjectGetSize(event.object) == static_cast<NormSize>(expected.size()) &&
            std::equal(expected.begin(), expected.end(), data);
        std::printf("{\"seconds\": %.4f, \"intact\": %s}\n", whole.count(),
                    intact ? "true" : "false");
        return intact ? 0 : 1;
    }
    return kNever;
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("A file to silent receivers of NORM: 64 segments and 190 of parity a block.");
    app.require_subcommand(1);
    CLI::App* const sending = app.add_subcommand("send", "send FILE, once or again and again");
    CLI::App* const receiving = app.add_subcommand("receive", "wait for the bytes of FILE");
    for (CLI::App* const command : {sending, receiving}) {
        command->add_option("FILE", options.file)->required();
        command->add_option("--group", options.group, "multicast group, IPv4")
            ->capture_default_str();
        command->add_option("--port", options.port)->capture_default_str();
        command->add_option("--interface", options.interface)->capture_default_str();
    }
    sending->add_option("--rate", options.rate, "bits per second with IP and UDP headers")
        ->capture_default_str();
    sending->add_flag("--repeat", options.repeat, "a carousel: the file is sent until killed");
    receiving->add_option("--wait", options.wait, "seconds until it gives up")
        ->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        return sending->parsed() ? send(options) : receive(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "norm_file: %s\n", error.what());
        return 2;
    }
}
