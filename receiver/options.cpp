// receiver/options.cpp
#include "receiver/options.hpp"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <map>
#include <stdexcept>
#include <vector>

#include "common/loss_options.hpp"
#include "common/number_text.hpp"

namespace ellicast::receiver {
namespace {

constexpr const char* kExamples = R"(
Examples:
  ellicast-recv
      listen on port 5004 and write received.ply when the stream has ended
  ellicast-recv --output horse-received.ply --reference horse.ply --report report.json
      also say how far the result is from the original
  ellicast-recv --listen 192.0.2.7:6000 --output models/ --until complete --idle-timeout 30
      name the file after the model; wait out pauses of a carousel
  ellicast-recv --drop 0.5 --loss-seed 7 --stages steps/
      try half the datagrams lost; keep the meshes of every stage

Ends by itself (--until), or by Ctrl-C, which keeps what was received.
Exit codes: 0 done, 2 usage or input error, 3 nothing received to rebuild from,
4 received, but the topology is not the promised one.)";

const std::map<std::string, Until> kUntil{{"end", Until::end},
                                          {"complete", Until::complete},
                                          {"round", Until::round},
                                          {"forever", Until::forever}};
const std::vector<std::string> kLogLevels{"trace", "debug", "info", "warn", "error", "off"};

// Texts as they come from the command line, before they mean anything.
struct Texts {
    std::string listen = ":5004";
    std::string reference;
    std::string stages;
    std::string report;
    std::string conceal = "on";
    double idle_timeout = 2.0;
    double wait = -1.0;
};

CLI::Validator seconds() {
    const auto check = [](std::string& text) -> std::string {
        const auto value = common::number<double>(text);
        // A year: far beyond use, far below what nanoseconds hold.
        const bool ok = value && *value > 0 && *value <= 3.2e7;
        return ok ? "" : "'" + text + "' is not a positive number of seconds";
    };
    return {check, "SECONDS"};
}

CLI::Validator endpoint() {
    const auto check = [](std::string& text) -> std::string {
        try {
            common::parse_endpoint(text);
            return "";
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
    };
    return {check, ""};
}

void add_receiver_options(CLI::App& app, Options& options, Texts& texts) {
    app.add_option("--listen", texts.listen,
                   "Address and port, IPv6 in brackets; no address: all, IPv4 and IPv6")
        ->type_name("[ADDR]:PORT")
        ->check(endpoint())
        ->capture_default_str();
    app.add_option(
           "-o,--output", options.output,
           "PLY to write; an existing directory or a trailing / names the file after the model")
        ->type_name("FILE")
        ->capture_default_str();
    app.add_option("--reference", texts.reference, "Original model, to measure the distance to")
        ->type_name("FILE");
    app.add_option("--stages", texts.stages, "Directory for the meshes of every stage")
        ->type_name("DIR");
    app.add_option("--report", texts.report, "JSON of what was received and made of it")
        ->type_name("FILE");
    app.add_option("--grid", options.grid, "Cells of the distance grid along the longest axis")
        ->type_name("CELLS")
        ->check(CLI::Range(8, 512))
        ->capture_default_str();
    app.add_option("--conceal", texts.conceal,
                   "Guess vertices that did not arrive, between those that did")
        ->type_name("on|off")
        ->check(CLI::IsMember({"on", "off"}).description(""))
        ->capture_default_str();
    app.add_option("--until", options.session.until, "When to stop receiving")
        ->type_name("RULE")
        ->transform(CLI::CheckedTransformer(kUntil).description("{end,complete,round,forever}"))
        ->default_str("end");
    app.add_option("--idle-timeout", texts.idle_timeout,
                   "Stop after a silence of this long, once something valid has arrived")
        ->check(seconds())
        ->type_name("SECONDS")
        ->capture_default_str();
    app.add_option("--wait", texts.wait, "Give up when nothing valid arrives for this long")
        ->check(seconds())
        ->type_name("SECONDS");
}

void add_program_options(CLI::App& app, Options& options) {
    app.add_option("--threads", options.threads, "Threads for geometry; 0: one per core")
        ->type_name("N")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
    app.add_option("--log-level", options.log_level, "trace, debug, info, warn, error or off")
        ->type_name("LEVEL")
        ->check(CLI::IsMember(kLogLevels).description(""))
        ->capture_default_str();
    app.add_flag("-q,--quiet", options.quiet, "Only warnings and errors; no progress, no summary");
    app.set_config("--config", "", "Read options from a file, lines of name=value")
        ->type_name("FILE");
    app.set_version_flag("--version", "ellicast-recv " ELLICAST_VERSION);
    common::add_loss_options(app, options.session.loss);
}

Time to_time(double seconds) {
    return Time(static_cast<std::int64_t>(std::llround(seconds * 1e9)));
}

void interpret(const Texts& texts, Options& options) {
    const auto path_of = [](const std::string& text) -> std::optional<std::filesystem::path> {
        if (text.empty()) return std::nullopt;
        return text;
    };
    options.listen = common::parse_endpoint(texts.listen);
    options.reference = path_of(texts.reference);
    options.stages = path_of(texts.stages);
    options.report = path_of(texts.report);
    options.conceal = texts.conceal == "on";
    options.session.idle_timeout = to_time(texts.idle_timeout);
    if (texts.wait > 0) options.session.wait = to_time(texts.wait);
}

}  // namespace

std::variant<Options, int> parse_options(int argc, const char* const* argv) {
    Options options;
    Texts texts;
    CLI::App app("Receives a 3D model from a lossy network and writes a closed surface.",
                 "ellicast-recv");
    app.footer(kExamples);
    app.allow_config_extras(CLI::config_extras_mode::error);
    app.failure_message([](const CLI::App*, const CLI::Error& error) {
        return "ellicast-recv: " + std::string(error.what()) + " (see --help)\n";
    });
    add_receiver_options(app, options, texts);
    add_program_options(app, options);
    try {
        app.parse(argc, argv);
        if (options.output.empty()) throw CLI::ValidationError("--output", "is empty");
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    interpret(texts, options);
    return options;
}

}  // namespace ellicast::receiver
