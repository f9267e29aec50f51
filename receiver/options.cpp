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
#include "receiver/output_files.hpp"

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
  ellicast-recv --listen [ff15::1]:5004 --interface eth0 --source 2001:db8::7
      what one sender sends to a multicast group
  ellicast-recv --sdp stream.sdp --output models/
      what the sender wrote about its stream says where to listen
  ellicast-recv --list
      say which pages are on air
  ellicast-recv --output models/ --page horse --page bunny --until forever --status now.json
      keep two pages of a carousel up to date
  ellicast-recv --live now.ply --update-interval 2
      a mesh to look at while the stream still runs
  ellicast-recv --verify studio.pub --state studio.starts
      only what the holder of a key signed, and no recording of an earlier session
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
    std::string sdp;
    std::string reference;
    std::string stages;
    std::string live;
    std::string live_series;
    double update_interval = 0.5;
    std::string report;
    std::string status;
    std::string max_memory = "1.5G";
    std::string conceal = "on";
    double idle_timeout = 3.0;
    double wait = -1.0;
    std::string psk;
    std::string state;
    double max_age = -1.0;
};

/// A number, perhaps with a fraction and k, M or G for powers of 1024.
std::size_t parse_bytes(const std::string& text) {
    std::string digits = text;
    double unit = 1.0;
    if (!digits.empty()) {
        const char last = digits.back();
        unit = last == 'k' ? 1024.0 : last == 'M' ? 1048576.0 : last == 'G' ? 1073741824.0 : 1.0;
        if (unit > 1.0) digits.pop_back();
    }
    const auto value = common::number<double>(digits);
    if (!value || !(*value * unit >= 65536.0) || !(*value * unit <= 1e15)) {
        throw common::refusal(text, "is not a number of bytes from 64k on");
    }
    return static_cast<std::size_t>(*value * unit);
}

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
    app.add_option(
           "--listen", texts.listen,
           "Address and port, IPv6 in brackets; a multicast group is joined; no address: all, "
           "IPv4 and IPv6")
        ->type_name("[ADDR]:PORT")
        ->check(endpoint())
        ->capture_default_str();
    app.add_option("--sdp", texts.sdp,
                   "Listen where this session description says, which ellicast-send --sdp wrote; "
                   "in place of --listen and --source")
        ->type_name("FILE");
    app.add_option("--interface", options.interface,
                   "Hear this interface alone; with a multicast group, join it here")
        ->type_name("NAME");
    app.add_option("--source", options.source,
                   "Of a multicast group, hear what this address sends and nothing else")
        ->type_name("ADDR");
    for (const char* const other : {"--listen", "--source"}) {
        app.get_option("--sdp")->excludes(other);
    }
    app.add_option(
           "-o,--output", options.output,
           "PLY to write; an existing directory or a trailing / gets every page, named after it")
        ->type_name("FILE")
        ->capture_default_str();
    app.add_option("--page", options.session.pages.wanted,
                   "Only this page, by name or object id; again for more of them")
        ->type_name("NAME|ID");
    app.add_flag(
        "--list", options.list,
        "Print what is on air and end: after --wait, 5 s by default, or when all is known");
    app.add_option("--reference", texts.reference, "Original model, to measure the distance to")
        ->type_name("FILE");
    app.add_option("--stages", texts.stages, "Directory for the meshes of every stage")
        ->type_name("DIR");
    app.add_option("--live", texts.live,
                   "PLY to keep up to date while datagrams arrive; replaced as a whole each time")
        ->type_name("FILE");
    app.add_option("--live-stages", texts.live_series,
                   "Directory for every such mesh: 00001.ply, 00002.ply, ...")
        ->type_name("DIR");
    app.add_option("--update-interval", texts.update_interval,
                   "At least so long from one live mesh to the next; 0: none")
        ->check(CLI::Range(0.0, 3.2e7).description(""))
        ->type_name("SECONDS")
        ->capture_default_str();
    app.add_option("--report", texts.report, "JSON of what was received and made of it")
        ->type_name("FILE");
    app.add_option("--status", texts.status, "JSON of what comes in, replaced every second")
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

CLI::Validator bytes() {
    const auto check = [](std::string& text) -> std::string {
        try {
            (void)parse_bytes(text);
            return "";
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
    };
    return {check, ""};
}

/// What strangers may make us hold.
void add_limits(CLI::App& app, Options& options, Texts& texts) {
    constexpr const char* kGroup = "Limits";
    StoreLimits& limits = options.session.limits;
    app.add_option("--max-pages", limits.groups,
                   "Objects held at a time, all senders together; lesser ones go for new ones")
        ->type_name("N")
        ->check(CLI::Range(1, 10'000).description(""))
        ->capture_default_str()
        ->group(kGroup);
    app.add_option("--max-vertices", limits.vertices, "Of one object; larger ones are not taken in")
        ->type_name("N")
        ->check(CLI::Range(1u, protocol::kMaxVertices).description(""))
        ->capture_default_str()
        ->group(kGroup);
    app.add_option("--max-memory", texts.max_memory,
                   "Bytes of all records, of which one object gets half; k, M, G")
        ->type_name("BYTES")
        ->check(bytes())
        ->capture_default_str()
        ->group(kGroup);
    app.add_option("--max-name", options.most_name_bytes, "Bytes of a file named after a page")
        ->type_name("N")
        ->check(CLI::Range(8, 200).description(""))
        ->capture_default_str()
        ->group(kGroup);
}

void add_trust_options(CLI::App& app, Options& options, Texts& texts) {
    app.add_option("--verify", options.trust.verify,
                   "Take only what was signed with this key: 64 hex digits or the name of a file; "
                   "may be given several times")
        ->type_name("PUBKEY")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--psk", texts.psk, "Take only what was sealed with the shared key in this file")
        ->type_name("FILE");
    app.add_option("--state", texts.state,
                   "Remember the newest session of each key here, and refuse older ones")
        ->type_name("FILE");
    app.add_option("--max-age", texts.max_age,
                   "Refuse what was sent so long ago, or ahead, by this host's clock")
        ->check(seconds())
        ->type_name("SECONDS");
    app.add_option("--unverified-queue", options.session.gate.queue,
                   "Datagrams that may wait for a look at their signature")
        ->type_name("N")
        ->check(CLI::Range(1, 1'000'000).description(""))
        ->capture_default_str()
        ->group("Limits");
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
    options.sdp = path_of(texts.sdp);
    options.reference = path_of(texts.reference);
    options.stages = path_of(texts.stages);
    options.live = path_of(texts.live);
    options.live_series = path_of(texts.live_series);
    options.update_interval = to_time(texts.update_interval);
    options.report = path_of(texts.report);
    options.status = path_of(texts.status);
    options.session.limits.bytes = parse_bytes(texts.max_memory);
    options.conceal = texts.conceal == "on";
    options.session.idle_timeout = to_time(texts.idle_timeout);
    if (texts.wait > 0) options.session.wait = to_time(texts.wait);
    options.session.pages.all = names_directory(options.output);
    if (options.session.pages.wanted.size() > 1 && !options.session.pages.all && !options.list) {
        throw CLI::ValidationError(
            "--output", "'" + options.output.string() + "' is one file for several --page");
    }
    if (options.list) {
        // Everybody is listened to, and the list says when it is full.
        options.session.until = Until::forever;
        if (!options.session.wait) options.session.wait = std::chrono::seconds(5);
    }
    options.trust.psk = path_of(texts.psk);
    options.trust.state = path_of(texts.state);
    if (texts.max_age > 0) {
        options.session.gate.max_age =
            std::chrono::duration_cast<std::chrono::microseconds>(to_time(texts.max_age));
    }
    options.session.gate.threads = options.threads;
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
    add_limits(app, options, texts);
    add_trust_options(app, options, texts);
    add_program_options(app, options);
    try {
        app.parse(argc, argv);
        if (options.output.empty()) throw CLI::ValidationError("--output", "is empty");
        const bool keys = !options.trust.verify.empty() || !texts.psk.empty();
        for (const char* const option : {"--state", "--max-age"}) {
            if (app.count(option) > 0 && !keys) {
                throw CLI::ValidationError(option, "needs --verify or --psk to believe any time");
            }
        }
        interpret(texts, options);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    return options;
}

}  // namespace ellicast::receiver
