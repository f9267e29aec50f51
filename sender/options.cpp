// sender/options.cpp
#include "sender/options.hpp"

#include <CLI/CLI.hpp>
#include <limits>
#include <stdexcept>

#include "common/hex_text.hpp"
#include "common/loss_options.hpp"
#include "common/number_text.hpp"
#include "common/text_values.hpp"
#include "sender/round_plan.hpp"

namespace ellicast::sender {
namespace {

constexpr const char* kExamples = R"(
Examples:
  ellicast-send horse.ply --to 192.0.2.7
      one round at 20 Mbit/s to port 5004
  ellicast-send horse.ply --to [2001:db8::7]:6000 --rate 2M --rounds forever
      a slow carousel, until Ctrl-C
  ellicast-send horse.ply --to 239.255.0.1 --interface eth0 --ttl 4 --rounds forever
      to everybody who has joined the group, over up to three routers
  ellicast-send horse.ply bunny.obj --to 192.0.2.7 --cache ~/.cache/ellicast
      two models, one after the other; the next start streams at once
  ellicast-send a.ply b.obj c.stl --to 192.0.2.7 --rounds forever --status now.json
      a carousel of three pages; a file that changes becomes a new version of its page
  ellicast-send horse.ply --to 239.255.0.1 --rounds forever --sdp horse.sdp
      describe the stream in a file that says where to listen (ellicast-recv --sdp horse.sdp)
  ellicast-send horse.ply --to 127.0.0.1 --drop 0.3 --loss-seed 7 --report sent.json
      lose three datagrams in ten on purpose, after numbering
  ellicast-send horse.ply --to 192.0.2.7 --redundancy 1.5
      half as many bytes again, for second copies of the vertices that matter most
  ellicast-send horse.ply --to 192.0.2.7 --order spread
      the vertices evenly instead of the most important first
  ellicast-send key --output studio && ellicast-send horse.ply --to 192.0.2.7 --sign studio
      make a pair of keys, and sign every datagram (ellicast-recv --verify studio.pub)
  ellicast-send horse.ply --decompose-only horse.ellipsoids
      compute the ellipsoids and send nothing

SIGHUP reads all models again; SIGTERM ends with the round, SIGINT at once.
Exit codes: 0 done, 2 usage or input error, 5 the rate could not be kept: below 90 % for three
seconds in a row.)";

const std::vector<std::string> kCriteria{"volume", "robust"};
const std::vector<std::string> kOrders{"importance", "spread"};
const std::vector<std::string> kLogLevels{"trace", "debug", "info", "warn", "error", "off"};
constexpr std::size_t kMaxPages = 1000;  // a table of contents of 200 s at five lines a second
constexpr const char* kIdentityGroup = "Identity of the stream (random unless given; for tests)";

// Texts as they come from the command line, before they mean anything.
struct Texts {
    std::string to;
    std::string loopback;
    std::string criterion = "robust";
    std::string tags = "8";
    std::string colour = "on";
    std::string edges = "on";
    std::string order = "importance";
    std::string design_loss = "0.3";
    std::string refine = "20";
    std::string certify;
    std::string rate = "20M";
    std::string rounds = "1";
    std::string redundancy = "1.0";
    std::string cache;
    std::string decompose_only;
    std::string report;
    std::string status;
    std::string sdp;
    std::string session;
    std::string sign;
    std::string psk;
};

std::uint64_t rate_of(const std::string& text) {
    return text == "0" ? 0 : common::parse_rate(text);
}

/// BITS, or BITS+ring.
TagOptions tags_of(const std::string& text) {
    constexpr std::string_view kRing = "+ring";
    TagOptions tags;
    tags.ring = text.ends_with(kRing);
    const auto bits = common::number<unsigned>(
        std::string_view(text).substr(0, text.size() - (tags.ring ? kRing.size() : 0)));
    if (!bits || (*bits != 0 && *bits != 8 && *bits != 12 && *bits != 16)) {
        throw common::refusal(text, "is not 0, 8, 12 or 16, with or without '+ring' behind it");
    }
    tags.normal_bits = static_cast<int>(*bits);
    return tags;
}

std::uint32_t rounds_of(const std::string& text) {
    if (text == "forever") return 0;
    const auto rounds = common::number<std::uint32_t>(text);
    if (!rounds) throw common::refusal(text, "is not a number of rounds, nor 'forever'");
    return *rounds;
}

double redundancy_of(const std::string& text) {
    const auto redundancy = common::number<double>(text);
    if (!redundancy || !(*redundancy >= 1.0 && *redundancy <= kMaxRedundancy)) {
        throw common::refusal(text, "is not a number from 1.0 to 3.0");
    }
    return *redundancy;
}

common::Endpoint destination_of(const std::string& text) {
    common::Endpoint destination = common::parse_endpoint(text);
    if (destination.host.empty()) throw common::refusal(text, "has no host");
    if (destination.port == 0) throw common::refusal(text, "nobody can be reached on port 0");
    return destination;
}

int refinement_of(const std::string& text) {
    constexpr int kMostRounds = 1000;
    if (text == "off") return 0;
    const auto rounds = common::number<int>(text);
    if (!rounds || *rounds < 0 || *rounds > kMostRounds) {
        throw common::refusal(text, "is not a number of rounds from 0 to 1000, nor 'off'");
    }
    return *rounds;
}

/// "0.5:0.95" is a loss of 0.5 and a share of 0.95.
CertificateGoal goal_of(const std::string& text) {
    const std::size_t colon = text.find(':');
    const auto loss = common::number<double>(text.substr(0, colon));
    const auto share =
        common::number<double>(colon == std::string::npos ? "" : text.substr(colon + 1));
    if (!loss || !(*loss >= 0.0 && *loss < 1.0)) {
        throw common::refusal(text, "is not LOSS:SHARE with a loss from 0 to below 1");
    }
    if (!share || !(*share >= 0.01 && *share <= 0.999)) {
        throw common::refusal(text, "is not LOSS:SHARE with a share from 0.01 to 0.999");
    }
    return {*loss, *share};
}

double design_loss_of(const std::string& text) {
    const auto loss = common::number<double>(text);
    if (!loss || !(*loss >= 0.0 && *loss <= 0.95)) {
        throw common::refusal(text, "is not a loss from 0 to 0.95");
    }
    return *loss;
}

protocol::SessionId session_of(const std::string& text) {
    const auto session = common::bytes_of_hex<sizeof(protocol::SessionId)>(text);
    if (!session) throw common::refusal(text, "is not a session id of 16 hex digits");
    return *session;
}

/// Refuses what `parse` refuses, with its words.
template <class Parse>
CLI::Validator accepted_by(Parse parse) {
    const auto check = [parse](std::string& text) -> std::string {
        try {
            parse(text);
            return "";
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
    };
    return {check, ""};
}

/// A whole number from low to high; unlike CLI's own conversion, refuses signs and what does not
/// fit.
template <class T>
CLI::Option* add_number(CLI::App& app, const std::string& name, T& value, T low, T high,
                        const std::string& help) {
    const auto check = [low, high](std::string& text) -> std::string {
        const auto number = common::number<T>(text);
        if (number && *number >= low && *number <= high) return "";
        return "'" + text + "' is not a whole number from " + std::to_string(low) + " to " +
               std::to_string(high);
    };
    return app.add_option(name, value, help)
        ->check(CLI::Validator(check, ""))
        ->type_name("N")
        ->capture_default_str();
}

void add_geometry_options(CLI::App& app, Options& options, Texts& texts) {
    DecompositionOptions& geometry = options.decomposition;
    app.add_option("MODEL", options.models, "PLY, OBJ, OFF or STL files to send")
        ->type_name("")
        ->required();
    add_number<std::size_t>(app, "--ellipsoids", geometry.ellipsoids, 1, protocol::kMaxEllipsoids,
                            "Ellipsoids that approximate the volume");
    add_number<std::size_t>(app, "--candidates", geometry.candidates, 1, 10'000'000,
                            "Seeds to grow candidates from");
    app.add_option("--criterion", texts.criterion,
                   "How to select them: volume, or robust against loss")
        ->type_name("RULE")
        ->check(CLI::IsMember(kCriteria).description(""))
        ->capture_default_str();
    app.add_option("--design-loss", texts.design_loss,
                   "Share of the ellipsoids whose loss 'robust' reckons with")
        ->type_name("P")
        ->check(accepted_by(design_loss_of))
        ->capture_default_str();
    app.add_option("--refine", texts.refine,
                   "Rounds of fitting the selected to the surface, or off: as they grew")
        ->type_name("ROUNDS")
        ->check(accepted_by(refinement_of))
        ->capture_default_str();
    app.add_option("--tags", texts.tags,
                   "Bits of a normal with every vertex: 0, 8, 12 or 16; '+ring' behind them adds a "
                   "byte about its neighbours")
        ->type_name("BITS[+ring]")
        ->check(accepted_by(tags_of))
        ->capture_default_str();
    app.add_option("--colour", texts.colour, "Colours of vertices, where the model has them")
        ->type_name("on|off")
        ->check(CLI::IsMember(std::vector<std::string>{"on", "off"}).description(""))
        ->capture_default_str();
    app.add_option("--edges", texts.edges,
                   "Name the few edges that a receiver would get wrong and that matter most")
        ->type_name("on|off")
        ->check(CLI::IsMember(std::vector<std::string>{"on", "off"}).description(""))
        ->capture_default_str();
    app.add_option("--order", texts.order,
                   "Of the vertices: importance (any prefix is a good model), or spread evenly")
        ->type_name("RULE")
        ->check(CLI::IsMember(kOrders).description(""))
        ->capture_default_str();
    add_number<std::uint64_t>(
        app, "--seed", geometry.seed, 0, std::numeric_limits<std::uint64_t>::max(),
        "Of seeds and of the order of vertices; another seed, another object");
    add_number<unsigned>(app, "--threads", geometry.threads, 0, 1024,
                         "Threads for geometry; 0: one per core");
    app.add_option(
           "--certify", texts.certify,
           "Have at least SHARE of the receivers see the right topology after losing LOSS of "
           "the datagrams: try it, and add copies or ellipsoids until they do")
        ->type_name("LOSS:SHARE")
        ->check(accepted_by(goal_of));
    app.add_option("--cache", texts.cache, "Keep decompositions here, and take them from here")
        ->type_name("DIR");
    app.add_option("--decompose-only", texts.decompose_only,
                   "Write the decomposition of one model and end")
        ->type_name("FILE");
}

void add_stream_options(CLI::App& app, Options& options, Texts& texts) {
    app.add_option("--to", texts.to,
                   "Where to send, a host or a multicast group; IPv6 addresses in brackets, port "
                   "5004 by default")
        ->type_name("HOST[:PORT]")
        ->check(accepted_by(destination_of));
    app.add_option("--rate", texts.rate,
                   "Bits per second, IP and UDP headers included; k, M, G; 0: unpaced. What the "
                   "link or this host cannot keep is refused")
        ->type_name("RATE")
        ->check(accepted_by(rate_of))
        ->capture_default_str();
    app.add_option("--rounds", texts.rounds, "Times to send everything, or forever")
        ->type_name("N")
        ->check(accepted_by(rounds_of))
        ->capture_default_str();
    add_number<std::size_t>(app, "--copies", options.copies, 1, 64,
                            "Of every ellipsoid in a round; large models get more; 1: just one");
    app.add_option("--redundancy", texts.redundancy,
                   "Bytes of a round, 1.0 to 3.0 times those of each vertex once; the rest are "
                   "second copies, of the first in order first")
        ->type_name("X")
        ->check(accepted_by(redundancy_of))
        ->capture_default_str();
    add_number<std::size_t>(app, "--datagram", options.datagram_bytes, protocol::kMinDatagramBytes,
                            protocol::kMaxDatagramBytes, "UDP payload in bytes, at most");
}

/// A whole number that stays empty unless given.
void add_small_number(CLI::App& app, const std::string& name, std::optional<int>& value, int low,
                      int high, const std::string& help) {
    const auto set = [name, low, high, &value](const std::string& text) {
        value = common::number<int>(text);
        if (value && *value >= low && *value <= high) return;
        throw CLI::ValidationError(name, "'" + text + "' is not a whole number from " +
                                             std::to_string(low) + " to " + std::to_string(high));
    };
    app.add_option_function<std::string>(name, set, help)->type_name("N");
}

void add_socket_options(CLI::App& app, Options& options, Texts& texts) {
    app.add_option("--interface", options.interface,
                   "Send by this interface, where routes would say another or none")
        ->type_name("NAME");
    add_small_number(app, "--ttl", options.ttl, 0, 255,
                     "Hops that datagrams may take; 1 by default for multicast groups");
    add_small_number(app, "--dscp", options.dscp, 0, 63,
                     "Differentiated services code point, such as 8 for bulk, 34 for video");
    app.add_option("--loopback", texts.loopback,
                   "Whether listeners on this host hear the multicast group too")
        ->type_name("on|off")
        ->check(CLI::IsMember(std::vector<std::string>{"on", "off"}).description(""));
    app.add_flag("--broadcast", options.broadcast, "The destination may be a broadcast address");
}

void add_program_options(CLI::App& app, Options& options, Texts& texts) {
    app.add_option("--report", texts.report, "JSON of what was made and sent")->type_name("FILE");
    app.add_option("--status", texts.status,
                   "JSON of what is on air, replaced as a whole every second")
        ->type_name("FILE");
    app.add_option("--sdp", texts.sdp,
                   "Describe the stream for receivers (SDP, RFC 8866), just before it begins")
        ->type_name("FILE");
    app.add_option("--stop-timeout", options.stop_timeout_s,
                   "What SIGTERM leaves the round to end; a second one, or Ctrl-C, ends at once")
        ->type_name("SECONDS")
        ->check(CLI::Range(0.0, 86400.0).description(""))
        ->capture_default_str();
    app.add_option("--log-level", options.log_level, "trace, debug, info, warn, error or off")
        ->type_name("LEVEL")
        ->check(CLI::IsMember(kLogLevels).description(""))
        ->capture_default_str();
    app.add_flag("-q,--quiet", options.quiet, "Only warnings and errors; no progress, no summary");
    app.set_config("--config", "", "Read options from a file, lines of name=value")
        ->type_name("FILE");
    app.set_version_flag("--version", "ellicast-send " ELLICAST_VERSION);
    common::add_loss_options(app, options.impairment);
}

void add_security_options(CLI::App& app, Texts& texts) {
    app.add_option("--sign", texts.sign,
                   "Private key to sign every datagram with; `ellicast-send key --help` makes one")
        ->type_name("FILE");
    app.add_option("--psk", texts.psk, "Shared key, 64 hex digits, to encrypt every datagram with")
        ->type_name("FILE");
}

/// For an optional number that stays empty unless given.
template <class T>
void add_identity_number(CLI::App& app, const std::string& name, std::optional<T>& value,
                         const std::string& help) {
    app.add_option_function<std::string>(
           name,
           [name, &value](const std::string& text) {
               value = common::number<T>(text);
               if (!value) {
                   throw CLI::ValidationError(name,
                                              "'" + text + "' is not a whole number from 0 to " +
                                                  std::to_string(std::numeric_limits<T>::max()));
               }
           },
           help)
        ->type_name("N")
        ->group(kIdentityGroup);
}

void add_identity_options(CLI::App& app, Options& options, Texts& texts) {
    app.add_option("--session", texts.session, "Session id")
        ->type_name("HEX")
        ->check(accepted_by(session_of))
        ->group(kIdentityGroup);
    add_identity_number(app, "--ssrc", options.identity.ssrc, "RTP source");
    add_identity_number(app, "--first-sequence", options.identity.first_sequence,
                        "RTP sequence number of the first datagram");
    add_identity_number(app, "--first-timestamp", options.identity.first_timestamp,
                        "RTP timestamp of the first datagram");
}

void interpret(const Texts& texts, Options& options) {
    const auto path_of = [](const std::string& text) -> std::optional<std::filesystem::path> {
        if (text.empty()) return std::nullopt;
        return text;
    };
    options.decomposition.criterion =
        texts.criterion == "volume" ? Criterion::volume : Criterion::robust;
    options.tags = tags_of(texts.tags);
    options.tags.colour = texts.colour == "on";
    options.tags.edges = texts.edges == "on";
    options.order = texts.order == "spread" ? SendingOrder::spread : SendingOrder::importance;
    options.decomposition.expected_loss = design_loss_of(texts.design_loss);
    options.decomposition.refine = refinement_of(texts.refine);
    if (!texts.certify.empty()) options.certify = goal_of(texts.certify);
    if (!texts.loopback.empty()) options.loopback = texts.loopback == "on";
    options.cache = path_of(texts.cache);
    options.decompose_only = path_of(texts.decompose_only);
    options.report = path_of(texts.report);
    options.sign = path_of(texts.sign);
    options.psk = path_of(texts.psk);
    if (options.protection().any() && !texts.session.empty()) {
        throw CLI::ValidationError("--session",
                                   "is drawn at random with --sign and --psk; a second stream with "
                                   "it would give the key away");
    }
    options.status = path_of(texts.status);
    options.sdp = path_of(texts.sdp);
    if (options.sdp && options.decompose_only) {
        throw CLI::ValidationError("--sdp", "there is no stream with --decompose-only");
    }
    options.bits_per_second = rate_of(texts.rate);
    options.rounds = rounds_of(texts.rounds);
    options.redundancy = redundancy_of(texts.redundancy);
    if (!texts.session.empty()) options.identity.session = session_of(texts.session);
    if (!texts.to.empty()) {
        const common::Endpoint destination = destination_of(texts.to);
        options.host = destination.host;
        options.port = destination.port.value_or(options.port);
    } else if (!options.decompose_only) {
        throw CLI::RequiredError("--to");
    }
    if (options.models.size() > kMaxPages) {
        throw CLI::ValidationError("MODEL", "at most " + std::to_string(kMaxPages) + " models");
    }
    if (options.decompose_only && options.models.size() > 1) {
        throw CLI::ValidationError("--decompose-only", "takes one model");
    }
}

}  // namespace

std::variant<Options, int> parse_options(int argc, const char* const* argv) {
    Options options;
    Texts texts;
    CLI::App app("Broadcasts 3D models over networks that lose packets.", "ellicast-send");
    app.footer(kExamples);
    app.allow_config_extras(CLI::config_extras_mode::error);
    app.failure_message([](const CLI::App*, const CLI::Error& error) {
        return "ellicast-send: " + std::string(error.what()) + " (see --help)\n";
    });
    add_geometry_options(app, options, texts);
    add_stream_options(app, options, texts);
    add_socket_options(app, options, texts);
    add_security_options(app, texts);
    add_program_options(app, options, texts);
    add_identity_options(app, options, texts);
    try {
        app.parse(argc, argv);
        interpret(texts, options);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    return options;
}

}  // namespace ellicast::sender
