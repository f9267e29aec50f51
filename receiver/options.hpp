// receiver/options.hpp
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "common/text_values.hpp"
#include "receiver/session.hpp"

namespace ellicast::receiver {

/// What the user asks of ellicast-recv. Paths are as given; nothing was looked at yet.
struct Options {
    common::Endpoint listen;  // empty host: any; no port: 5004
    std::filesystem::path output = "received.ply";
    std::optional<std::filesystem::path> reference;
    std::optional<std::filesystem::path> stages;  // directory
    std::optional<std::filesystem::path> report;
    int grid = 96;
    bool conceal = true;
    unsigned threads = 0;  // 0: one per core
    std::string log_level = "info";
    bool quiet = false;
    SessionOptions session;
};

/// Parses the command line. Gives the exit code instead when there is nothing left to do: 0 after
/// --help and --version, 2 after a line on stderr that names what is wrong.
std::variant<Options, int> parse_options(int argc, const char* const* argv);

}  // namespace ellicast::receiver
