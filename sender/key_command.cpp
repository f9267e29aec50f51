// sender/key_command.cpp
#include "sender/key_command.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>

#include "common/hex_text.hpp"
#include "common/key_file.hpp"

namespace ellicast::sender {
namespace {

constexpr const char* kExamples = R"(
Examples:
  ellicast-send key --output studio
      a pair: studio, for ellicast-send --sign, and studio.pub, for ellicast-recv --verify
  ellicast-send key --shared --output team
      one secret key for the --psk of both programs

Secret files can be read by their owner alone. Exit codes: 0 done, 2 usage or input error.)";

struct KeyOptions {
    std::filesystem::path output;
    bool shared = false;
    bool force = false;
};

void write_key(const KeyOptions& options) {
    if (options.shared) {
        common::write_shared_key(options.output, common::SharedKey::random(), options.force);
        return;
    }
    const auto key = common::SigningKey::random();
    common::write_signing_key(options.output, key, options.force);
    std::printf("%s\n", common::hex_text(key.public_key()).c_str());
}

}  // namespace

int run_key_command(int argc, const char* const* argv) {
    KeyOptions options;
    CLI::App app("Makes keys for signed and sealed streams; prints the public one.",
                 "ellicast-send key");
    app.footer(kExamples);
    app.failure_message([](const CLI::App*, const CLI::Error& error) {
        return "ellicast-send key: " + std::string(error.what()) + " (see --help)\n";
    });
    app.add_option("-o,--output", options.output,
                   "Private key to write; the public one goes to the same name with .pub")
        ->type_name("FILE")
        ->required();
    app.add_flag("--shared", options.shared, "A shared secret key instead of a pair");
    app.add_flag("--force", options.force, "Replace files that exist");
    try {
        app.parse(argc, argv);
        write_key(options);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const common::KeyError& error) {
        std::fprintf(stderr, "ellicast-send key: %s\n", error.what());
        return 2;
    }
    return 0;
}

}  // namespace ellicast::sender
