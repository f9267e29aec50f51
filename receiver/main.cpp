// receiver/main.cpp
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <exception>
#include <variant>

#include "common/model_io.hpp"
#include "receiver/options.hpp"
#include "receiver/program.hpp"
#include "receiver/udp_endpoint.hpp"

using namespace ellicast::receiver;

namespace {

void set_up_log(const Options& options) {
    spdlog::set_default_logger(spdlog::stderr_color_mt("ellicast-recv"));
    spdlog::set_pattern("%n: %^%l%$: %v");
    spdlog::set_level(spdlog::level::from_str(options.log_level));
    if (options.quiet && spdlog::get_level() < spdlog::level::warn) {
        spdlog::set_level(spdlog::level::warn);
    }
}

int fail(const char* reason) {
    std::fprintf(stderr, "ellicast-recv: %s\n", reason);
    return static_cast<int>(ExitCode::usage);
}

}  // namespace

int main(int argc, char** argv) {
    const std::variant<Options, int> parsed = parse_options(argc, argv);
    if (const int* const code = std::get_if<int>(&parsed)) return *code;
    const Options& options = std::get<Options>(parsed);
    try {
        set_up_log(options);
        return static_cast<int>(run(options));
    } catch (const std::exception& error) {  // ModelError, KeyError, ListenError: the user's
        return fail(error.what());
    }
}
