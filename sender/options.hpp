// sender/options.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/loss_model.hpp"
#include "protocol/datagram.hpp"
#include "protocol/secured_datagram.hpp"
#include "sender/broadcast_object.hpp"
#include "sender/decomposition.hpp"
#include "sender/topology_certificate.hpp"
#include "sender/vertex_tags.hpp"

namespace ellicast::sender {

/// What identifies a stream; whatever is empty is drawn from the operating system's random source.
struct FixedIdentity {
    std::optional<protocol::SessionId> session;
    std::optional<std::uint32_t> ssrc;
    std::optional<std::uint16_t> first_sequence;
    std::optional<std::uint32_t> first_timestamp;
};

/// What the user asks of ellicast-send. Paths are as given; nothing was looked at yet.
struct Options {
    std::vector<std::filesystem::path> models;  // at least one
    std::string host;                           // "" only with decompose_only
    std::uint16_t port = 5004;
    TagOptions tags;
    DecompositionOptions decomposition;  // its seed and threads are the program's
    SendingOrder order = SendingOrder::importance;
    std::size_t copies = 3;
    double redundancy = 1.0;  // bytes of a round, in rounds that hold each vertex once
    std::optional<CertificateGoal> certify;
    std::uint64_t bits_per_second = 20'000'000;  // 0: as fast as the socket takes them
    std::uint32_t rounds = 1;                    // 0: forever
    std::size_t datagram_bytes = protocol::kDefaultDatagramBytes;
    std::string interface;         // "": as the routes say
    std::optional<int> ttl;        // hops; empty: the system's, 1 to multicast groups
    std::optional<int> dscp;       // 0 to 63
    std::optional<bool> loopback;  // of multicast
    bool broadcast = false;
    std::optional<std::filesystem::path> cache;           // directory
    std::optional<std::filesystem::path> decompose_only;  // file
    std::optional<std::filesystem::path> report;
    std::optional<std::filesystem::path> status;
    std::optional<std::filesystem::path> sdp;
    double stop_timeout_s = 10.0;  // what SIGTERM leaves the round to end
    std::string log_level = "info";
    bool quiet = false;
    common::ImpairmentOptions impairment;
    std::optional<std::filesystem::path> sign;  // private key
    std::optional<std::filesystem::path> psk;   // shared key
    FixedIdentity identity;

    [[nodiscard]] protocol::Protection protection() const {
        return {.sealed = psk.has_value(), .is_signed = sign.has_value()};
    }
};

/// Parses the command line. Gives the exit code instead when there is nothing left to do: 0 after
/// --help and --version, 2 after a line on stderr that names what is wrong.
std::variant<Options, int> parse_options(int argc, const char* const* argv);

}  // namespace ellicast::sender
