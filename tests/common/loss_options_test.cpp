// tests/common/loss_options_test.cpp
#include "common/loss_options.hpp"

#include <CLI/CLI.hpp>
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace {

using namespace ellicast::common;

ImpairmentOptions parse(std::vector<std::string> arguments) {
    CLI::App app;
    ImpairmentOptions options;
    add_loss_options(app, options);
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes a vector from its back
    app.parse(arguments);
    return options;
}

/// The line that a user sees; empty when the arguments are taken.
std::string refusal_of(const std::vector<std::string>& arguments) {
    try {
        (void)parse(arguments);
    } catch (const CLI::ParseError& error) {
        return error.what();
    }
    return {};
}

/// A file in the temporary directory, gone at the end.
class TraceFile {
  public:
    explicit TraceFile(const std::string& content)
        : path_(std::filesystem::temp_directory_path() /
                ("ellicast-trace-" + std::to_string(std::hash<std::string>{}(content)))) {
        std::ofstream(path_) << content;
    }
    ~TraceFile() { std::filesystem::remove(path_); }
    TraceFile(const TraceFile&) = delete;
    TraceFile& operator=(const TraceFile&) = delete;
    [[nodiscard]] std::string option() const { return "trace:" + path_.string(); }

  private:
    std::filesystem::path path_;
};

}  // namespace

TEST_CASE("without options nothing is impaired") {
    const ImpairmentOptions options = parse({});
    CHECK_FALSE(options.any());
    CHECK(options.seed == 1);
}

TEST_CASE("each option sets its own field") {
    CHECK(parse({"--drop", "0.3"}).drop == 0.3);
    CHECK(parse({"--drop-ellipsoids", "0.4"}).drop_ellipsoids == 0.4);
    CHECK(parse({"--drop-vertices=1"}).drop_vertices == 1.0);
    CHECK(parse({"--reorder", "0.5"}).reorder == 0.5);
    CHECK(parse({"--duplicate", "0.6"}).duplicate == 0.6);
    CHECK(parse({"--corrupt", "1e-2"}).corrupt == 1e-2);
    CHECK(parse({"--loss-seed", "18446744073709551615"}).seed == ~std::uint64_t{0});
    CHECK(std::get<GilbertLoss>(*parse({"--loss", "gilbert:.1,.2,.3,.4"}).loss).loss_good == 0.4);
}

TEST_CASE("a trace is read from its file") {
    const TraceFile file("# burst\n0011\n");
    CHECK(std::get<TraceLoss>(*parse({"--loss", file.option()}).loss).lost ==
          std::vector<bool>{false, false, true, true});
}

TEST_CASE("bad values are refused in one line that names the flag") {
    for (const char* flag : {"--drop", "--drop-ellipsoids", "--drop-vertices", "--reorder",
                             "--duplicate", "--corrupt"}) {
        for (const char* value : {"-0.1", "1.01", "nan", "inf", "x", "0.5x", "0x1", ""}) {
            CAPTURE(flag, value);
            const std::string line = refusal_of({std::string(flag) + "=" + value});
            REQUIRE(line.find(flag) != std::string::npos);
        }
        CHECK(refusal_of({flag}).find(flag) != std::string::npos);
    }
    for (const char* value : {"-1", "1.5", "18446744073709551616", "x", ""}) {
        CAPTURE(value);
        CHECK(refusal_of({std::string("--loss-seed=") + value}).find("--loss-seed") !=
              std::string::npos);
    }
}

TEST_CASE("bad processes and traces are refused in one line that names the flag and the text") {
    const TraceFile empty("# nothing\n");
    const TraceFile words("0101 lost\n");
    for (const std::string& value : std::vector<std::string>{
             "bernoulli:2", "gilbert:1", "weather", "trace:", "trace:/no/such/file", "trace:/",
             empty.option(), words.option()}) {
        CAPTURE(value);
        const std::string line = refusal_of({"--loss", value});
        CHECK(line.starts_with("--loss: "));
        const std::string shown = value.substr(value.starts_with("trace:") ? 6 : 0);
        CHECK(line.find(std::string("'").append(shown).append("'")) != std::string::npos);
        CHECK(line.find('\n') == std::string::npos);
    }
}

TEST_CASE("help shows the options in a group of their own") {
    CLI::App app;
    ImpairmentOptions options;
    add_loss_options(app, options);
    const std::string help = app.help();
    CHECK(help.find("Simulated loss:") != std::string::npos);
    for (const char* flag :
         {"--drop P", "--drop-ellipsoids P", "--drop-vertices P", "--loss PROCESS", "--reorder P",
          "--duplicate P", "--corrupt P", "--loss-seed S"}) {
        CHECK(help.find(flag) != std::string::npos);
    }
}
