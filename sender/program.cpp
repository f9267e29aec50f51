// sender/program.cpp
#include "sender/program.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/atomic_file.hpp"
#include "sender/model_watch.hpp"
#include "sender/page_loading.hpp"
#include "sender/page_names.hpp"
#include "sender/rate_watch.hpp"
#include "sender/report.hpp"
#include "sender/session.hpp"
#include "sender/stream_control.hpp"
#include "sender/stream_description.hpp"
#include "sender/stream_security.hpp"
#include "sender/udp_endpoint.hpp"

namespace ellicast::sender {
namespace {

bool shows_progress(const Options& options) {
    return !options.quiet && ::isatty(STDERR_FILENO) == 1;
}

/// The models in page order, their plans, and what their files were like just before.
struct Pages {
    std::vector<std::optional<FileStamp>> stamps;
    std::vector<LoadedModel> models;
    std::vector<RoundPlan> plans;
};

Pages load_pages(const Options& options, const std::vector<std::string>& names,
                 const Identity& identity) {
    Pages pages;
    for (std::size_t page = 0; page < options.models.size(); ++page) {
        pages.stamps.push_back(stamp_of(options.models[page]));
        pages.models.push_back(load_page(page, names[page], options, shows_progress(options)));
    }
    for (LoadedModel& model : pages.models) {
        pages.plans.push_back(
            make_plan(model, options, identity.session, options.models.size() > 1));
    }
    return pages;
}

Session make_session(std::vector<RoundPlan> plans, const Options& options, const Identity& identity,
                     StreamKeys keys, std::size_t ip_udp_bytes) {
    SessionOptions session_options;
    session_options.bits_per_second = options.bits_per_second;
    session_options.ip_udp_bytes = ip_udp_bytes;
    session_options.ssrc = identity.ssrc;
    session_options.first_sequence = identity.first_sequence;
    session_options.first_timestamp = identity.first_timestamp;
    session_options.impairment = options.impairment;
    return {std::move(plans), session_options, begin_security(std::move(keys), identity.session)};
}

void show_progress(const Session& session, const std::string& peer) {
    const SessionCounts& counts = session.counts();
    const std::optional<std::uint64_t> all = session.datagrams_in_all();
    const std::string of = all ? " of " + std::to_string(*all) : "";
    std::fprintf(stderr, "\r%s: round %u, %llu%s datagrams\033[K", peer.c_str(), counts.rounds + 1,
                 static_cast<unsigned long long>(counts.offered), of.c_str());
}

/// Watches the files of the pages unless each is sent just once.
std::unique_ptr<ModelWatch> watch_pages(const Options& options, const Identity& identity,
                                        const std::vector<std::string>& names, const Pages& pages) {
    if (options.rounds == 1) return nullptr;
    std::vector<protocol::ObjectId> objects;
    objects.reserve(pages.plans.size());
    for (const RoundPlan& plan : pages.plans) objects.push_back(plan.object().id);
    const auto load = [options, session = identity.session, names](std::size_t page) {
        LoadedModel model = load_page(page, names[page], options, false);
        RoundPlan plan = make_plan(model, options, session, true);
        return FreshPage{page, std::move(model), std::move(plan)};
    };
    return std::make_unique<ModelWatch>(options.models, pages.stamps, std::move(objects), load);
}

// From this rate on, 24 datagrams leave each millisecond, in batches: as one buffer they cost a
// third. Below, what counts packets on this host should count datagrams.
constexpr std::uint64_t kSegmentsFrom = 240'000'000;

SocketOptions socket_options_of(const Options& options) {
    SocketOptions socket;
    socket.segments = options.bits_per_second == 0 || options.bits_per_second >= kSegmentsFrom;
    socket.interface = options.interface;
    socket.ttl = options.ttl;
    socket.dscp = options.dscp;
    socket.loopback = options.loopback;
    socket.broadcast = options.broadcast;
    return socket;
}

/// Throws SendError when the link is known to be slower than the stream is to be.
void require_link(const Options& options, const UdpEndpoint& endpoint) {
    const std::optional<Link> link = endpoint.link();
    if (!link || options.bits_per_second <= link->bits_per_second) return;
    throw SendError(fmt::format("--rate: {:g} Mbit/s are more than the {:g} Mbit/s of {}",
                                static_cast<double>(options.bits_per_second) / 1e6,
                                static_cast<double>(link->bits_per_second) / 1e6, link->interface));
}

void write_description(const Options& options, const Identity& identity,
                       const std::vector<std::string>& names, const UdpEndpoint& endpoint,
                       const SecuritySummary& security) {
    if (!options.sdp) return;
    const StreamWay way{endpoint.peer_address(), endpoint.local_address()};
    const auto description = describe_stream(options, identity, names, way, security.public_key);
    try {
        common::write_file_atomically(*options.sdp,
                                      protocol::session_description_text(description));
    } catch (const common::WriteFailure& failure) {
        throw SendError("--sdp " + options.sdp->string() + ": " + failure.what());
    }
    spdlog::info("the stream is described in {}", options.sdp->string());
}

SendOutcome send(Session& session, UdpEndpoint& endpoint, StreamControl& control,
                 const Options& options) {
    SendOutcome outcome;
    outcome.peer = endpoint.peer();
    outcome.ip_udp_bytes = endpoint.ip_udp_bytes();
    const bool progress = shows_progress(options);
    const Time start = UdpEndpoint::now();
    RunHooks hooks;
    hooks.stop_within = std::chrono::milliseconds(std::llround(1000.0 * options.stop_timeout_s));
    if (options.rounds != 1) hooks.on_hangup = [&] { control.on_hangup(); };
    RateWatch rate(options.bits_per_second, options.datagram_bytes + outcome.ip_udp_bytes);
    hooks.on_tick = [&] {
        const Time now = UdpEndpoint::now();
        if (progress) show_progress(session, outcome.peer);
        control.on_tick(now);
        return rate.look(now, session.counts().paid_bytes);
    };
    control.begin(start);
    outcome.interrupted = !endpoint.run(session, hooks);
    if (progress) std::fputs("\r\033[K", stderr);
    control.end(UdpEndpoint::now());
    outcome.seconds = std::chrono::duration<double>(UdpEndpoint::now() - start).count();
    outcome.session = session.counts();
    outcome.versions = session.versions();
    outcome.endpoint = endpoint.counts();
    outcome.rate_not_kept = rate.achieved();
    return outcome;
}

/// Whether a stream of some length was slower than asked for.
bool fell_behind(const SendOutcome& outcome, const Options& options) {
    constexpr double kLeastSeconds = 1.0;  // before, the machine's hiccups weigh as much
    constexpr double kShare = 0.98;
    return outcome.seconds >= kLeastSeconds && outcome.session.dropped == 0 &&
           outcome.endpoint.refused == 0 && !outcome.rate_not_kept &&
           achieved_rate(outcome) < kShare * static_cast<double>(options.bits_per_second);
}

/// Three digits that count, without a power of ten: "0.997", "20", "1000".
std::string megabits(double bits_per_second) {
    const double value = bits_per_second / 1e6;
    return value < 100.0 ? fmt::format("{:.3g}", value) : fmt::format("{:.0f}", value);
}

void log_outcome(const SendOutcome& outcome, const Options& options) {
    const EndpointCounts& counts = outcome.endpoint;
    const auto asked = static_cast<double>(options.bits_per_second);
    spdlog::info("{} {} of {} datagrams to {}, {} bytes in {:.2f} s, {} Mbit/s",
                 outcome.interrupted ? "interrupted after" : "sent", counts.sent,
                 outcome.session.offered, outcome.peer, counts.bytes, outcome.seconds,
                 megabits(achieved_rate(outcome)));
    if (fell_behind(outcome, options)) {
        spdlog::warn("the socket did not keep {} Mbit/s: ask for less", megabits(asked));
    }
    if (outcome.rate_not_kept) {
        spdlog::error(
            "--rate: {:g} Mbit/s were asked for, and socket and host kept {} for {} s: "
            "ask for less, or for 0, which is as fast as they can",
            asked / 1e6, megabits(*outcome.rate_not_kept), RateWatch::kWindows);
    }
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
    std::vector<LoadedModel> models;
    models.push_back(decompose_page(0, options, shows_progress(options)));
    write_report_of(options, models, {}, std::nullopt);
}

}  // namespace

ExitCode run(const Options& options, const Identity& identity) {
    if (options.report) check_writable(*options.report);
    if (options.status) check_writable(*options.status);
    if (options.sdp) check_writable(*options.sdp);
    if (options.decompose_only) {
        run_decomposition(options);
        return ExitCode::done;
    }

    // Before the work on the models, so that a wrong key or address shows at once.
    StreamKeys keys = read_stream_keys(options);
    UdpEndpoint endpoint(options.host, options.port, options.datagram_bytes,
                         socket_options_of(options));
    require_link(options, endpoint);
    const std::vector<std::string> names = page_names(options.models);
    Pages pages = load_pages(options, names, identity);
    const std::unique_ptr<ModelWatch> watch = watch_pages(options, identity, names, pages);
    const SecuritySummary security = summarise(keys, options, endpoint.ip_udp_bytes());
    write_description(options, identity, names, endpoint, security);
    Session session = make_session(std::move(pages.plans), options, identity, std::move(keys),
                                   endpoint.ip_udp_bytes());
    StreamControl control(options, session, endpoint, std::move(pages.models), watch.get());
    SendOutcome outcome = send(session, endpoint, control, options);
    outcome.security = security;
    log_outcome(outcome, options);
    write_report_of(options, control.models(), session.plans(), outcome);
    const ExitCode code = outcome.rate_not_kept ? ExitCode::rate_not_kept : ExitCode::done;
    if (watch && watch->busy()) {  // nobody waits for a model that will not be sent any more
        spdlog::shutdown();
        std::fflush(nullptr);
        std::_Exit(static_cast<int>(code));
    }
    return code;
}

}  // namespace ellicast::sender
