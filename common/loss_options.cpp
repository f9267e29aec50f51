// common/loss_options.cpp
#include "common/loss_options.hpp"

#include <CLI/CLI.hpp>
#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "common/number_text.hpp"

namespace ellicast::common {
namespace {

constexpr const char* kGroup = "Simulated loss";
constexpr std::size_t kMaxTraceBytes = std::size_t{64} << 20;  // days at any sensible rate

std::string read_trace_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw refusal(path, "cannot be read");
    std::string content;
    std::string chunk(1 << 16, '\0');
    while (file) {
        file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
        content.append(chunk, 0, static_cast<std::size_t>(file.gcount()));
        if (content.size() > kMaxTraceBytes) {
            throw refusal(path, "larger than 64 MiB");
        }
    }
    if (file.bad()) throw refusal(path, "reading failed");
    return content;
}

LossProcess loss_from(const std::string& text) {
    constexpr std::string_view kTrace = "trace:";
    if (!text.starts_with(kTrace)) return parse_loss(text);
    const std::string path = text.substr(kTrace.size());
    const std::string content = read_trace_file(path);
    try {
        return parse_trace(content);
    } catch (const std::invalid_argument& error) {
        throw refusal(path, error.what());
    }
}

/// Unlike CLI::Range, refuses NaN.
CLI::Validator probability() {
    const auto check = [](std::string& text) -> std::string {
        const auto p = number<double>(text);
        const bool ok = p && *p >= 0.0 && *p <= 1.0;
        return ok ? "" : "'" + text + "' is not a probability between 0 and 1";
    };
    return {check, ""};
}

/// Unlike CLI's own conversion, refuses signs and what does not fit.
CLI::Validator seed() {
    const auto check = [](std::string& text) -> std::string {
        const bool ok = number<std::uint64_t>(text).has_value();
        return ok ? "" : "'" + text + "' is not a whole number from 0 to 18446744073709551615";
    };
    return {check, ""};
}

void add_probability(CLI::App& app, const char* flag, double& value, const char* help) {
    app.add_option(flag, value, help)->check(probability())->group(kGroup)->type_name("P");
}

}  // namespace

void add_loss_options(CLI::App& app, ImpairmentOptions& options) {
    add_probability(app, "--drop", options.drop, "Lose each datagram with this probability");
    add_probability(app, "--drop-ellipsoids", options.drop_ellipsoids,
                    "Lose each section of ellipsoids with this probability");
    add_probability(app, "--drop-vertices", options.drop_vertices,
                    "Lose each section of vertices with this probability");
    const auto set_loss = [&options](const std::string& text) {
        try {
            options.loss = loss_from(text);
        } catch (const std::invalid_argument& error) {
            throw CLI::ValidationError("--loss", error.what());
        }
    };
    app.add_option_function<std::string>(
           "--loss", set_loss,
           "Lose datagrams by a process: bernoulli:P, gilbert:p,r[,lb,lg] (p good to bad, r bad to "
           "good, lb and lg the loss in the bad and the good state, 1 and 0 by default), or "
           "trace:FILE (0 arrives, 1 is lost, repeated)")
        ->group(kGroup)
        ->type_name("PROCESS");
    add_probability(app, "--reorder", options.reorder,
                    "Hold a datagram back behind 1 to 8 later ones with this probability");
    add_probability(app, "--duplicate", options.duplicate,
                    "Deliver a datagram twice with this probability");
    add_probability(app, "--corrupt", options.corrupt,
                    "Flip 1 to 8 bits of a datagram with this probability");
    app.add_option("--loss-seed", options.seed, "Seed of all simulated loss")
        ->check(seed())
        ->group(kGroup)
        ->type_name("S")
        ->capture_default_str();
}

}  // namespace ellicast::common
