#include "sender/page_loading.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <optional>
#include <utility>

#include "sender/certified_loading.hpp"

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
    plan.security_bytes = protocol::security_bytes(options.protection());
    plan.copies = options.copies;
    plan.redundancy = options.redundancy;
    plan.bits_per_second = options.bits_per_second;
    plan.rounds = options.rounds;
    return plan;
}

LoadedModel load_certified_model(const std::filesystem::path& path, const Options& options,
                                 bool progress) {
    CertificationOptions certification;
    certification.trial.goal = *options.certify;
    certification.trial.seed = options.decomposition.seed;
    certification.trial.threads = options.decomposition.threads;
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

}  // namespace

LoadedModel load_page(std::size_t page, const std::string& name, const Options& options,
                      bool progress) {
    const std::filesystem::path& path = options.models[page];
    LoadedModel model = options.certify ? load_certified_model(path, options, progress)
                                        : load_model(path, options.decomposition, options.cache,
                                                     options.tags, options.order);
    model.object.description.name = name;
    log_model(model);
    return model;
}

LoadedModel decompose_page(std::size_t page, const Options& options, bool progress) {
    const std::filesystem::path& path = options.models[page];
    DecompositionOptions decomposition = options.decomposition;
    std::optional<Certificate> certificate;
    if (options.certify) certificate = load_certified_model(path, options, progress).certificate;
    if (certificate) decomposition.ellipsoids = certificate->ellipsoids;
    LoadedModel model =
        decompose_to_file(path, decomposition, options.cache, *options.decompose_only);
    model.certificate = certificate;
    log_model(model);
    return model;
}

RoundPlan make_plan(LoadedModel& model, const Options& options, const protocol::SessionId& session,
                    bool paged) {
    PlanOptions plan_options = plan_options_of(options);
    plan_options.session = session;
    plan_options.paged = paged;
    if (model.certificate) plan_options.copies = model.certificate->copies;
    RoundPlan plan(std::move(model.object), plan_options);
    spdlog::info("{}: {} vertices, {} ellipsoids x {}, {} datagrams a round", model.path.string(),
                 plan.object().vertices.size(), plan.object().ellipsoids.size(), plan.copies(),
                 plan.datagrams());
    return plan;
}

}  // namespace ellicast::sender
