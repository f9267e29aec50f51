// sender/main.cpp: ellicast-send.
#include <sys/random.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <stdexcept>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "sender/model_loading.hpp"
#include "sender/options.hpp"
#include "sender/send_report.hpp"
#include "sender/session.hpp"
#include "sender/udp_endpoint.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::sender;

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
T random_value() {
    T value{};
    if (::getrandom(&value, sizeof value, 0) != static_cast<ssize_t>(sizeof value)) {
        throw std::runtime_error("no random numbers from the operating system");
    }
    return value;
}

void log_model(const LoadedModel& model) {
    for (const std::string& warning : model.warnings) {
        spdlog::warn("{}: {}", model.path.string(), warning);
    }
    for (const StageTime& stage : model.stages) {
        spdlog::debug("{}: {} took {:.3f} s, {:.3f} s CPU", model.path.string(), stage.stage,
                      stage.wall_s, stage.cpu_s);
    }
}

std::vector<LoadedModel> load_models(const Options& options) {
    std::vector<LoadedModel> models;
    for (const std::filesystem::path& path : options.models) {
        models.push_back(options.decompose_only
                             ? decompose_to_file(path, options.decomposition, options.cache,
                                                 *options.decompose_only)
                             : load_model(path, options.decomposition, options.cache));
        log_model(models.back());
    }
    return models;
}

std::vector<RoundPlan> make_plans(std::vector<LoadedModel>& models, const Options& options) {
    PlanOptions plan;
    plan.datagram_bytes = options.datagram_bytes;
    plan.copies = options.copies;
    plan.bits_per_second = options.bits_per_second;
    plan.rounds = options.rounds;
    plan.session = options.identity.session ? *options.identity.session
                                            : random_value<protocol::SessionId>();
    std::vector<RoundPlan> plans;
    for (LoadedModel& model : models) {
        plans.emplace_back(std::move(model.object), plan);
        const RoundPlan& made = plans.back();
        spdlog::info("{}: {} vertices, {} ellipsoids x {}, {} datagrams a round",
                     model.path.string(), made.object().vertices.size(),
                     made.object().ellipsoids.size(), made.copies(), made.datagrams());
    }
    return plans;
}

Session make_session(std::vector<RoundPlan> plans, const Options& options,
                     const UdpEndpoint& endpoint) {
    const FixedIdentity& fixed = options.identity;
    SessionOptions session;
    session.bits_per_second = options.bits_per_second;
    session.ip_udp_bytes = endpoint.ip_udp_bytes();
    session.ssrc = fixed.ssrc ? *fixed.ssrc : random_value<std::uint32_t>();
    session.first_sequence =
        fixed.first_sequence ? *fixed.first_sequence : random_value<std::uint16_t>();
    session.first_timestamp =
        fixed.first_timestamp ? *fixed.first_timestamp : random_value<std::uint32_t>();
    session.impairment = options.impairment;
    return {std::move(plans), session};
}

void show_progress(const Session& session, const SendOutcome& outcome) {
    const std::optional<std::uint64_t> all = session.datagrams_in_all();
    std::fprintf(stderr, "\r%s: round %u, %llu", outcome.peer.c_str(), session.counts().rounds + 1,
                 static_cast<unsigned long long>(session.counts().offered));
    if (all) std::fprintf(stderr, " of %llu", static_cast<unsigned long long>(*all));
    std::fprintf(stderr, " datagrams\033[K");
}

SendOutcome send(Session& session, UdpEndpoint& endpoint, const Options& options) {
    SendOutcome outcome;
    outcome.peer = endpoint.peer();
    outcome.ip_udp_bytes = endpoint.ip_udp_bytes();
    const bool progress = !options.quiet && ::isatty(STDERR_FILENO) == 1;
    const Time start = UdpEndpoint::now();
    outcome.interrupted = !endpoint.run(session, [&] {
        if (progress) show_progress(session, outcome);
    });
    if (progress) std::fputs("\r\033[K", stderr);
    outcome.seconds = std::chrono::duration<double>(UdpEndpoint::now() - start).count();
    outcome.session = session.counts();
    outcome.endpoint = endpoint.counts();
    return outcome;
}

void log_outcome(const SendOutcome& outcome) {
    const EndpointCounts& counts = outcome.endpoint;
    spdlog::info("{} {} of {} datagrams to {}, {} bytes in {:.2f} s ({:.2f} Mbit/s)",
                 outcome.interrupted ? "interrupted; sent" : "sent", counts.sent,
                 outcome.session.offered, outcome.peer, counts.bytes, outcome.seconds,
                 achieved_rate(outcome) / 1e6);
    if (counts.refused > 0) {
        spdlog::warn("{} datagrams were refused: {}", counts.refused, counts.last_refusal);
    }
    if (counts.unreachable > 0) {
        spdlog::warn("nobody listens at {}, says its host ({} times)", outcome.peer,
                     counts.unreachable);
    }
}

void run(const Options& options) {
    if (options.report) check_writable(*options.report);
    if (options.decompose_only) check_writable(*options.decompose_only);
    std::optional<UdpEndpoint> endpoint;  // before the work, so that a wrong address shows at once
    if (!options.decompose_only) {
        endpoint.emplace(options.host, options.port, options.datagram_bytes);
    }
    std::vector<LoadedModel> models = load_models(options);
    std::optional<SendOutcome> outcome;
    std::optional<Session> session;
    if (endpoint) {
        session.emplace(make_session(make_plans(models, options), options, *endpoint));
        outcome = send(*session, *endpoint, options);
        log_outcome(*outcome);
    }
    if (options.report) {
        const std::vector<RoundPlan> none;
        write_report(*options.report,
                     report_json(options, models, session ? session->plans() : none, outcome));
    }
}

}  // namespace

int main(int argc, char** argv) {
    const auto parsed = parse_options(argc, argv);
    if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
    const Options& options = std::get<Options>(parsed);
    try {
        set_up_log(options);
        run(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "ellicast-send: %s\n", error.what());
        return 2;
    }
    return 0;
}
