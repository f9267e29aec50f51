// sender/main.cpp: ellicast-send
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/random.h>

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string_view>
#include <variant>

#include "sender/key_command.hpp"
#include "sender/options.hpp"
#include "sender/program.hpp"

using namespace ellicast::sender;

namespace {

void set_up_log(const Options& options) {
    spdlog::set_default_logger(spdlog::stderr_color_mt("ellicast-send"));
    spdlog::set_pattern("%n: %^%l%$: %v");
    spdlog::set_level(spdlog::level::from_str(options.log_level));
    if (options.quiet && spdlog::get_level() < spdlog::level::warn) {
        spdlog::set_level(spdlog::level::warn);
    }
}

/// From the operating system; nothing else in the program is random.
template <class T>
T drawn_unless(const std::optional<T>& fixed) {
    if (fixed) return *fixed;
    T value{};
    if (::getrandom(&value, sizeof value, 0) != static_cast<ssize_t>(sizeof value)) {
        throw std::runtime_error("the operating system gives no random numbers");
    }
    return value;
}

Identity identity_of(const FixedIdentity& fixed) {
    return {drawn_unless(fixed.session), drawn_unless(fixed.ssrc),
            drawn_unless(fixed.first_sequence), drawn_unless(fixed.first_timestamp)};
}

}  // namespace

int main(int argc, char** argv) {
    // A model of this name is ./key.
    if (argc > 1 && std::string_view(argv[1]) == "key") return run_key_command(argc - 1, argv + 1);
    const std::variant<Options, int> parsed = parse_options(argc, argv);
    if (const int* const code = std::get_if<int>(&parsed)) return *code;
    const Options& options = std::get<Options>(parsed);
    try {
        set_up_log(options);
        return static_cast<int>(run(options, identity_of(options.identity)));
    } catch (const std::exception& error) {  // SendError, ModelError, KeyError: the user's
        std::fprintf(stderr, "ellicast-send: %s\n", error.what());
        return static_cast<int>(ExitCode::usage);
    }
}
