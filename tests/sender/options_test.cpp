// tests/sender/options_test.cpp
#include "sender/options.hpp"

#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>

namespace ellicast::sender {
namespace {

struct Parsed {
    std::variant<Options, int> result;
    std::string out;
    std::string err;
};

Parsed parse(std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "ellicast-send");
    std::ostringstream out;
    std::ostringstream err;
    std::streambuf* const old_out = std::cout.rdbuf(out.rdbuf());
    std::streambuf* const old_err = std::cerr.rdbuf(err.rdbuf());
    std::variant<Options, int> result =
        parse_options(static_cast<int>(arguments.size()), arguments.data());
    std::cout.rdbuf(old_out);
    std::cerr.rdbuf(old_err);
    return {std::move(result), out.str(), err.str()};
}

Options accepted(const std::vector<const char*>& arguments) {
    const Parsed parsed = parse(arguments);
    INFO(parsed.err);
    REQUIRE(std::holds_alternative<Options>(parsed.result));
    return std::get<Options>(parsed.result);
}

}  // namespace

TEST_CASE("defaults are those of the manual") {
    const Options options = accepted({"horse.ply", "--to", "localhost"});
    CHECK(options.models == std::vector<std::filesystem::path>{"horse.ply"});
    CHECK(options.host == "localhost");
    CHECK(options.port == 5004);
    CHECK(options.decomposition.ellipsoids == 400);
    CHECK(options.decomposition.candidates == 10'000);
    CHECK(options.decomposition.criterion == Criterion::robust);
    CHECK(options.decomposition.expected_loss == 0.3);
    CHECK_FALSE(options.certify);
    CHECK(options.decomposition.refine == 20);
    CHECK(options.decomposition.seed == 1);
    CHECK(options.tags.normal_bits == 8);
    CHECK_FALSE(options.tags.ring);
    CHECK(options.tags.colour);
    CHECK(options.order == SendingOrder::importance);
    CHECK(options.copies == 3);
    CHECK(options.redundancy == 1.0);
    CHECK(options.bits_per_second == 20'000'000);
    CHECK(options.rounds == 1);
    CHECK(options.datagram_bytes == 1200);
    CHECK_FALSE(options.impairment.any());
    CHECK_FALSE(options.cache.has_value());
    CHECK_FALSE(options.report.has_value());
    CHECK_FALSE(options.identity.session.has_value());
}

TEST_CASE("every flag reaches its option") {
    const Options options = accepted({"a.ply",
                                      "b.obj",
                                      "--to",
                                      "[::1]:6000",
                                      "--ellipsoids",
                                      "200",
                                      "--candidates",
                                      "2500",
                                      "--copies",
                                      "2",
                                      "--certify",
                                      "0.6:0.99",
                                      "--design-loss",
                                      "0.4",
                                      "--refine",
                                      "7",
                                      "--criterion",
                                      "volume",
                                      "--redundancy",
                                      "1.75",
                                      "--order",
                                      "spread",
                                      "--rate",
                                      "1.5M",
                                      "--rounds",
                                      "forever",
                                      "--datagram",
                                      "1400",
                                      "--seed",
                                      "18446744073709551615",
                                      "--cache",
                                      "c",
                                      "--report",
                                      "r.json",
                                      "--log-level",
                                      "debug",
                                      "--quiet",
                                      "--threads",
                                      "2",
                                      "--drop",
                                      "0.3",
                                      "--loss",
                                      "gilbert:0.1,0.5",
                                      "--loss-seed",
                                      "9",
                                      "--session",
                                      "0123456789abCDEF",
                                      "--ssrc",
                                      "4294967295",
                                      "--first-sequence",
                                      "65535",
                                      "--first-timestamp",
                                      "0"});
    CHECK(options.models.size() == 2);
    CHECK(options.host == "::1");
    CHECK(options.port == 6000);
    CHECK(options.decomposition.ellipsoids == 200);
    CHECK(options.decomposition.candidates == 2500);
    CHECK(options.decomposition.expected_loss == 0.4);
    CHECK(options.certify == CertificateGoal{0.6, 0.99});
    CHECK(options.decomposition.refine == 7);
    CHECK(options.decomposition.criterion == Criterion::volume);
    CHECK(options.order == SendingOrder::spread);
    CHECK(options.decomposition.seed == 18'446'744'073'709'551'615u);
    CHECK(options.decomposition.threads == 2);
    CHECK(options.copies == 2);
    CHECK(options.redundancy == 1.75);
    CHECK(options.bits_per_second == 1'500'000);
    CHECK(options.rounds == 0);
    CHECK(options.datagram_bytes == 1400);
    CHECK(options.cache == "c");
    CHECK(options.report == "r.json");
    CHECK(options.log_level == "debug");
    CHECK(options.quiet);
    CHECK(options.impairment.drop == 0.3);
    CHECK(options.impairment.seed == 9);
    CHECK(options.impairment.loss.has_value());
    CHECK(options.identity.session ==
          protocol::SessionId{0x01, 0x23, 0x45, 0x67, 0x89, 0xab, 0xcd, 0xef});
    CHECK(options.identity.ssrc == 4'294'967'295u);
    CHECK(options.identity.first_sequence == 65'535);
    CHECK(options.identity.first_timestamp == 0u);
}

TEST_CASE("refinement can be switched off") {
    CHECK(accepted({"a.ply", "--to", "h", "--refine", "off"}).decomposition.refine == 0);
}

TEST_CASE("a rate of 0 means unpaced, and 0 rounds mean forever") {
    const Options options = accepted({"a.ply", "--to", "h", "--rate", "0", "--rounds", "0"});
    CHECK(options.bits_per_second == 0);
    CHECK(options.rounds == 0);
}

TEST_CASE("tags are a number of bits, with or without a ring") {
    const auto tags = [](const char* text) {
        return accepted({"a.ply", "--to", "h", "--tags", text}).tags;
    };
    for (const int bits : {0, 8, 12, 16}) {
        const std::string text = std::to_string(bits);
        CHECK(tags(text.c_str()).normal_bits == bits);
        CHECK_FALSE(tags(text.c_str()).ring);
        CHECK(tags((text + "+ring").c_str()).normal_bits == bits);
        CHECK(tags((text + "+ring").c_str()).ring);
    }
    CHECK(accepted({"a.ply", "--to", "h", "--colour", "on"}).tags.colour);
    CHECK_FALSE(accepted({"a.ply", "--to", "h", "--colour", "off"}).tags.colour);
}

TEST_CASE("decomposing needs no destination") {
    CHECK(accepted({"a.ply", "--decompose-only", "f"}).decompose_only == "f");
    CHECK(accepted({"a.ply", "--to", "h", "--sdp", "s"}).sdp == "s");
    CHECK_FALSE(accepted({"a.ply", "--to", "h"}).sdp.has_value());
}

TEST_CASE("what cannot be meant ends in exit code 2 and one line that names the flag") {
    const std::vector<const char*> arguments = GENERATE(
        std::vector<const char*>{"a.ply"},  // no --to
        std::vector<const char*>{"--to", "h"}, std::vector<const char*>{"a.ply", "--to", "h:0"},
        std::vector<const char*>{"a.ply", "--to", "h:65536"},
        std::vector<const char*>{"a.ply", "--to", "h:http"},
        std::vector<const char*>{"a.ply", "--to", ":5004"},
        std::vector<const char*>{"a.ply", "--to", ""},
        std::vector<const char*>{"a.ply", "--to", "h", "--rate", "fast"},
        std::vector<const char*>{"a.ply", "--to", "h", "--rate", "-1"},
        std::vector<const char*>{"a.ply", "--to", "h", "--rounds", "-1"},
        std::vector<const char*>{"a.ply", "--to", "h", "--order", "random"},
        std::vector<const char*>{"a.ply", "--to", "h", "--redundancy", "0.99"},
        std::vector<const char*>{"a.ply", "--to", "h", "--redundancy", "3.01"},
        std::vector<const char*>{"a.ply", "--to", "h", "--redundancy", "nan"},
        std::vector<const char*>{"a.ply", "--to", "h", "--rounds", "4294967296"},
        std::vector<const char*>{"a.ply", "--to", "h", "--ellipsoids", "0"},
        std::vector<const char*>{"a.ply", "--to", "h", "--ellipsoids", "65536"},
        std::vector<const char*>{"a.ply", "--to", "h", "--ellipsoids", "many"},
        std::vector<const char*>{"a.ply", "--to", "h", "--candidates", "0"},
        std::vector<const char*>{"a.ply", "--to", "h", "--copies", "0"},
        std::vector<const char*>{"a.ply", "--to", "h", "--copies", "65"},
        std::vector<const char*>{"a.ply", "--to", "h", "--design-loss", "1"},
        std::vector<const char*>{"a.ply", "--to", "h", "--refine", "on"},
        std::vector<const char*>{"a.ply", "--to", "h", "--certify", "0.5"},
        std::vector<const char*>{"a.ply", "--to", "h", "--certify", "1:0.95"},
        std::vector<const char*>{"a.ply", "--to", "h", "--certify", "0.5:1"},
        std::vector<const char*>{"a.ply", "--to", "h", "--certify", "0.5:nan"},
        std::vector<const char*>{"a.ply", "--to", "h", "--criterion", "beauty"},
        std::vector<const char*>{"a.ply", "--to", "h", "--datagram", "575"},
        std::vector<const char*>{"a.ply", "--to", "h", "--datagram", "65508"},
        std::vector<const char*>{"a.ply", "--to", "h", "--seed", "-1"},
        std::vector<const char*>{"a.ply", "--to", "h", "--tags", "10"},
        std::vector<const char*>{"a.ply", "--to", "h", "--tags", "ring"},
        std::vector<const char*>{"a.ply", "--to", "h", "--tags", "+ring"},
        std::vector<const char*>{"a.ply", "--to", "h", "--tags", "8+rings"},
        std::vector<const char*>{"a.ply", "--to", "h", "--tags", "8 +ring"},
        std::vector<const char*>{"a.ply", "--to", "h", "--tags", ""},
        std::vector<const char*>{"a.ply", "--to", "h", "--colour", "red"},
        std::vector<const char*>{"a.ply", "--to", "h", "--drop", "1.5"},
        std::vector<const char*>{"a.ply", "--to", "h", "--drop", "nan"},
        std::vector<const char*>{"a.ply", "--to", "h", "--loss", "rain:0.1"},
        std::vector<const char*>{"a.ply", "--to", "h", "--session", "12"},
        std::vector<const char*>{"a.ply", "--to", "h", "--first-sequence", "65536"},
        std::vector<const char*>{"a.ply", "--to", "h", "--log-level", "loud"},
        std::vector<const char*>{"a.ply", "--to", "h", "--config", "/no/such/file"},
        std::vector<const char*>{"a.ply", "--to", "h", "--frobnicate"},
        std::vector<const char*>{"a.ply", "--decompose-only", "f", "--sdp", "s"},
        std::vector<const char*>{"a.ply", "b.ply", "--decompose-only", "f"});
    std::string line;
    for (const char* argument : arguments) line += std::string(argument) + " ";
    CAPTURE(line);
    const Parsed parsed = parse(arguments);
    REQUIRE(std::holds_alternative<int>(parsed.result));
    CHECK(std::get<int>(parsed.result) == 2);
    CHECK(parsed.out.empty());
    CAPTURE(parsed.err);
    CHECK(std::count(parsed.err.begin(), parsed.err.end(), '\n') == 1);
    CHECK(parsed.err.starts_with("ellicast-send: "));
    if (arguments.size() > 3) {
        const char* flag = "";
        for (const char* argument : arguments) {
            if (argument[0] == '-' && argument[1] == '-') flag = argument;
        }
        if (std::string(flag) == "--config") flag = "/no/such/file";
        CHECK_THAT(parsed.err, Catch::Contains(flag));
    }
}

TEST_CASE("help shows every flag with examples, version the version, both end with 0") {
    const Parsed help = parse({"--help"});
    REQUIRE(std::holds_alternative<int>(help.result));
    CHECK(std::get<int>(help.result) == 0);
    for (const char* text : {"MODEL",
                             "--to",
                             "--ellipsoids",
                             "--candidates",
                             "--copies",
                             "--criterion",
                             "--certify",
                             "--refine",
                             "--design-loss",
                             "--order",
                             "--redundancy",
                             "--rate",
                             "--rounds",
                             "--datagram",
                             "--seed",
                             "--cache",
                             "--decompose-only",
                             "--tags",
                             "--colour",
                             "--report",
                             "--sdp",
                             "--log-level",
                             "--quiet",
                             "--config",
                             "--version",
                             "--threads",
                             "--drop",
                             "--drop-ellipsoids",
                             "--drop-vertices",
                             "--loss",
                             "Examples:",
                             "Exit codes"}) {
        CHECK_THAT(help.out, Catch::Contains(text));
    }
    CHECK(help.err.empty());
    const Parsed version = parse({"--version"});
    REQUIRE(std::holds_alternative<int>(version.result));
    CHECK(std::get<int>(version.result) == 0);
    CHECK(version.out.starts_with("ellicast-send 0."));
}

TEST_CASE("a file of options is read, and the command line overrides it") {
    const std::string path = (std::filesystem::temp_directory_path() /
                              ("ellicast-options-" + std::to_string(::getpid())))
                                 .string();
    std::ofstream(path) << "to=\"192.0.2.1:7000\"\nrate=5M\nellipsoids=100\n";
    const Options options = accepted({"a.ply", "--config", path.c_str(), "--ellipsoids", "50"});
    CHECK(options.host == "192.0.2.1");
    CHECK(options.port == 7000);
    CHECK(options.bits_per_second == 5'000'000);
    CHECK(options.decomposition.ellipsoids == 50);
    std::ofstream(path) << "tow=nowhere\n";
    const Parsed wrong = parse({"a.ply", "--to", "h", "--config", path.c_str()});
    REQUIRE(std::holds_alternative<int>(wrong.result));
    CHECK(std::get<int>(wrong.result) == 2);
    std::remove(path.c_str());
}

}  // namespace ellicast::sender
