// receiver/options.hpp
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "common/text_values.hpp"
#include "receiver/session.hpp"
#include "receiver/trust.hpp"

namespace ellicast::receiver {

/// What the user asks of ellicast-recv. Paths are as given; nothing was looked at yet.
struct Options {
    common::Endpoint listen;                   // empty host: any; no port: 5004
    std::string interface;                     // "": any
    std::string source;                        // of a multicast group; "": any
    std::optional<std::filesystem::path> sdp;  // says all of this in their place
    std::filesystem::path output = "received.ply";
    std::optional<std::filesystem::path> reference;
    std::optional<std::filesystem::path> stages;  // directory
    std::optional<std::filesystem::path> report;
    std::optional<std::filesystem::path> status;
    bool list = false;
    std::optional<std::filesystem::path> live;              // file
    std::optional<std::filesystem::path> live_series;       // directory
    Time update_interval = std::chrono::milliseconds(500);  // zero: no live meshes
    int grid = 96;
    std::size_t most_name_bytes = 100;  // of a file named after a page
    bool conceal = true;
    unsigned threads = 0;  // 0: one per core
    std::string log_level = "info";
    bool quiet = false;
    TrustSources trust;  // keys; the rest of what the gate is to do is in `session`
    SessionOptions session;
};

/// Parses the command line. Gives the exit code instead when there is nothing left to do: 0 after
/// --help and --version, 2 after a line on stderr that names what is wrong.
std::variant<Options, int> parse_options(int argc, const char* const* argv);

}  // namespace ellicast::receiver
