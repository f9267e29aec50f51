// sender/program.cpp
#include "sender/program.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "sender/certified_loading.hpp"
#include "sender/model_loading.hpp"
#include "sender/report.hpp"
#include "sender/session.hpp"
#include "sender/udp_endpoint.hpp"

namespace ellicast::sender {
namespace {

void log_certificate(const LoadedModel& model) {
    const Certificate& certificate = *model.certificate;
    if (certificate.holds) {
        spdlog::info("{}: {}, with {} copies of {} ellipsoids", model.path.string(),
                     certificate_text(certificate), certificate.copies, certificate.ellipsoids);
        return;
    }
    spdlog::warn(
        "{}: no certificate: a topology right for {:g} at loss {:g} was not reached; the best was "
        "{} of {} draws (at least {:.3f}) with {} copies of {} ellipsoids",
        model.path.string(), certificate.goal.share, certificate.goal.loss, certificate.right,
        certificate.draws, certificate.lower_bound, certificate.copies, certificate.ellipsoids);
}

void log_model(const LoadedModel& model) {
    if (model.certificate) log_certificate(model);
    for (const std::string& warning : model.warnings) {
        spdlog::warn("{}: {}", model.path.string(), warning);
    }
    for (const StageTime& stage : model.stages) {
        spdlog::debug("{}: {} took {:.3f} s, {:.3f} s CPU", model.path.string(), stage.stage,
                      stage.wall_s, stage.cpu_s);
    }
}

PlanOptions plan_options_of(const Options& options) {
    PlanOptions plan;
    plan.datagram_bytes = options.datagram_bytes;
    plan.copies = options.copies;
    plan.redundancy = options.redundancy;
    plan.bits_per_second = options.bits_per_second;
    plan.rounds = options.rounds;
    return plan;
}

LoadedModel load_certified_model(const std::filesystem::path& path, const Options& options) {
    CertificationOptions certification;
    certification.trial.goal = *options.certify;
    certification.trial.seed = options.decomposition.seed;
    certification.trial.threads = options.decomposition.threads;
    const bool progress = !options.quiet && ::isatty(STDERR_FILENO) == 1;
    certification.trial.on_draws = [&](const LossTrial& trial) {
        if (!progress) return;
        std::fprintf(stderr, "\r%s: certifying, %zu of %zu draws right\033[K", path.c_str(),
                     trial.right, trial.draws);
    };
    certification.plan = plan_options_of(options);
    certification.ellipsoids = options.decomposition.ellipsoids;
    certification.cache = options.cache;
    const auto load = [&](std::size_t ellipsoids) {
        DecompositionOptions decomposition = options.decomposition;
        decomposition.ellipsoids = ellipsoids;
        return load_model(path, decomposition, options.cache, options.tags, options.order);
    };
    LoadedModel model = load_certified(load, certification);
    if (progress) std::fputs("\r\033[K", stderr);
    return model;
}

LoadedModel decompose_only(const std::filesystem::path& path, const Options& options) {
    DecompositionOptions decomposition = options.decomposition;
    std::optional<Certificate> certificate;
    if (options.certify) certificate = load_certified_model(path, options).certificate;
    if (certificate) decomposition.ellipsoids = certificate->ellipsoids;
    LoadedModel model =
        decompose_to_file(path, decomposition, options.cache, *options.decompose_only);
    model.certificate = certificate;
    return model;
}

std::vector<LoadedModel> load_models(const Options& options) {
    std::vector<LoadedModel> models;
    for (const std::filesystem::path& path : options.models) {
        if (options.decompose_only) {
            models.push_back(decompose_only(path, options));
        } else if (options.certify) {
            models.push_back(load_certified_model(path, options));
        } else {
            models.push_back(load_model(path, options.decomposition, options.cache, options.tags,
                                        options.order));
        }
        log_model(models.back());
    }
    return models;
}

/// Takes the objects out of the models.
std::vector<RoundPlan> make_plans(std::vector<LoadedModel>& models, const Options& options,
                                  const Identity& identity) {
    PlanOptions plan_options = plan_options_of(options);
    plan_options.session = identity.session;
    std::vector<RoundPlan> plans;
    for (LoadedModel& model : models) {
        plan_options.copies = model.certificate ? model.certificate->copies : options.copies;
        const RoundPlan& plan = plans.emplace_back(std::move(model.object), plan_options);
        spdlog::info("{}: {} vertices, {} ellipsoids x {}, {} datagrams a round",
                     model.path.string(), plan.object().vertices.size(),
                     plan.object().ellipsoids.size(), plan.copies(), plan.datagrams());
    }
    return plans;
}

Session make_session(std::vector<RoundPlan> plans, const Options& options, const Identity& identity,
                     std::size_t ip_udp_bytes) {
    SessionOptions session_options;
    session_options.bits_per_second = options.bits_per_second;
    session_options.ip_udp_bytes = ip_udp_bytes;
    session_options.ssrc = identity.ssrc;
    session_options.first_sequence = identity.first_sequence;
    session_options.first_timestamp = identity.first_timestamp;
    session_options.impairment = options.impairment;
    return {std::move(plans), session_options};
}

void show_progress(const Session& session, const std::string& peer) {
    const SessionCounts& counts = session.counts();
    const std::optional<std::uint64_t> all = session.datagrams_in_all();
    const std::string of = all ? " of " + std::to_string(*all) : "";
    std::fprintf(stderr, "\r%s: round %u, %llu%s datagrams\033[K", peer.c_str(), counts.rounds + 1,
                 static_cast<unsigned long long>(counts.offered), of.c_str());
}

SendOutcome send(Session& session, UdpEndpoint& endpoint, const Options& options) {
    SendOutcome outcome;
    outcome.peer = endpoint.peer();
    outcome.ip_udp_bytes = endpoint.ip_udp_bytes();
    const bool progress = !options.quiet && ::isatty(STDERR_FILENO) == 1;
    const Time start = UdpEndpoint::now();
    outcome.interrupted = !endpoint.run(session, [&] {
        if (progress) show_progress(session, outcome.peer);
    });
    if (progress) std::fputs("\r\033[K", stderr);
    outcome.seconds = std::chrono::duration<double>(UdpEndpoint::now() - start).count();
    outcome.session = session.counts();
    outcome.endpoint = endpoint.counts();
    return outcome;
}

void log_outcome(const SendOutcome& outcome) {
    const EndpointCounts& counts = outcome.endpoint;
    spdlog::info("{} {} of {} datagrams to {}, {} bytes in {:.2f} s, {:.3g} Mbit/s",
                 outcome.interrupted ? "interrupted after" : "sent", counts.sent,
                 outcome.session.offered, outcome.peer, counts.bytes, outcome.seconds,
                 achieved_rate(outcome) / 1e6);
    if (counts.refused > 0) {
        spdlog::warn("{} datagrams were refused: {}", counts.refused, counts.last_refusal);
    }
    if (counts.unreachable > 0) {
        spdlog::warn("nobody listens at {}, its host said {} times", outcome.peer,
                     counts.unreachable);
    }
}

void write_report_of(const Options& options, const std::vector<LoadedModel>& models,
                     const std::vector<RoundPlan>& plans,
                     const std::optional<SendOutcome>& outcome) {
    if (!options.report) return;
    write_report(*options.report, report_json(options, models, plans, outcome));
}

void run_decomposition(const Options& options) {
    check_writable(*options.decompose_only);
    write_report_of(options, load_models(options), {}, std::nullopt);
}

}  // namespace

void run(const Options& options, const Identity& identity) {
    if (options.report) check_writable(*options.report);
    if (options.decompose_only) return run_decomposition(options);

    // Before the work on the models, so that a wrong address shows at once.
    UdpEndpoint endpoint(options.host, options.port, options.datagram_bytes);
    std::vector<LoadedModel> models = load_models(options);
    Session session = make_session(make_plans(models, options, identity), options, identity,
                                   endpoint.ip_udp_bytes());
    const SendOutcome outcome = send(session, endpoint, options);
    log_outcome(outcome);
    write_report_of(options, models, session.plans(), outcome);
}

}  // namespace ellicast::sender
