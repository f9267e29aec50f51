// receiver/program.cpp
#include "receiver/program.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/model_io.hpp"
#include "common/service_notification.hpp"
#include "receiver/listening.hpp"
#include "receiver/live_view.hpp"
#include "receiver/output_files.hpp"
#include "receiver/page_list.hpp"
#include "receiver/page_result.hpp"
#include "receiver/page_writer.hpp"
#include "receiver/progress.hpp"
#include "receiver/report.hpp"
#include "receiver/stage_clock.hpp"
#include "receiver/status.hpp"
#include "receiver/trust.hpp"
#include "receiver/udp_endpoint.hpp"

namespace ellicast::receiver {
namespace {

/// What is in hand once reception is over.
struct Reception {
    SessionSummary summary;
    std::uint64_t kernel_dropped = 0;
    std::vector<PageTask> tasks;                // of the chosen pages, the shown one first
    std::vector<ReceivedObject> objects;        // theirs
    std::map<std::string, PageResult> written;  // by name, while they were received
    std::optional<LiveSummary> live;
    std::size_t listed = 0;
};

void check_outputs(const Options& options) {
    if (names_directory(options.output)) {
        check_writable_directory(options.output);
    } else {
        check_writable_file(options.output);
    }
    if (options.stages) check_writable_directory(*options.stages);
    if (options.live && names_directory(*options.live)) {
        check_writable_directory(*options.live);
    } else if (options.live) {
        check_writable_file(*options.live);
    }
    if (options.status) check_writable_file(*options.status);
    if (options.live_series) check_writable_directory(*options.live_series);
    if (options.report) check_writable_file(*options.report);
    if (options.trust.state) check_writable_file(*options.trust.state);
}

std::optional<common::TriangleMesh> read_reference(const Options& options) {
    if (!options.reference) return std::nullopt;
    common::TriangleMesh reference = common::read_model(*options.reference);
    for (const common::Triangle& t : reference.triangles) {
        const Eigen::Vector3d ab = reference.positions[t[1]] - reference.positions[t[0]];
        const Eigen::Vector3d ac = reference.positions[t[2]] - reference.positions[t[0]];
        if (ab.cross(ac).squaredNorm() > 0.0) return reference;
    }
    throw common::ModelError("'" + options.reference->string() + "' has no surface to measure to");
}

std::optional<LiveOptions> live_options_of(const Options& options) {
    LiveOptions live;
    live.file = options.live;
    live.series = options.live_series;
    live.interval = options.update_interval;
    live.grid = options.grid;
    live.conceal = options.conceal;
    live.most_name_bytes = options.most_name_bytes;
    return live.wanted() ? std::optional(live) : std::nullopt;
}

/// By the system's clock, which may be set while we run.
std::chrono::microseconds since_1970() {
    return std::chrono::duration_cast<std::chrono::microseconds>(
        std::chrono::system_clock::now().time_since_epoch());
}

/// What goes on beside the session, on its thread.
class Companions {
  public:
    Companions(const Options& options, const UdpEndpoint& endpoint, Time start)
        : options_(options), endpoint_(endpoint), start_(start), status_(options.status) {
        if (const auto how = live_options_of(options)) live_.emplace(*how);
        if (names_directory(options.output) && !options.list) {
            writer_.emplace(PageWriterOptions{options.output, options.grid, options.conceal,
                                              options.most_name_bytes});
        }
        notification_.ready("listening on " + endpoint.address());
    }

    void on_arrival(Time now, const Session& session) {
        if (live_) live_->on_arrival(now, session);
    }
    void on_tick(Time now, Session& session) {
        if (progress_.shown() && ++ticks_ % 2 == 0) progress_.update(progress_text(session, now));
        if (writer_ && writes_pages(session)) writer_->on_tick(now, session);
        if (status_.due(now)) {
            write_status(session.store().latest() ? "receiving" : "waiting", session, now);
        }
        notification_.alive_when_due(now);
        // A moment for other stations after the first is known.
        if (options_.list && lists_all(session)) {
            if (!listed_at_) listed_at_ = now + std::chrono::milliseconds(500);
            if (now >= *listed_at_) session.interrupt(now);
        } else {
            listed_at_.reset();
        }
        if (options_.list && now >= start_ + *options_.session.wait) session.interrupt(now);
    }
    void end(const Session& session, Time now, Reception& reception) {
        notification_.stopping();
        if (live_) reception.live = live_->summary();
        if (writer_) reception.written = writer_->written();
        if (status_.wanted()) write_status("ended", session, now);
    }

  private:
    /// A page that ends reception by itself is written once, at the end.
    [[nodiscard]] bool writes_pages(const Session& session) const {
        return options_.session.until == Until::forever || !session.catalogue().all().empty();
    }
    void write_status(const char* state, const Session& session, Time now) {
        StatusFacts facts;
        facts.state = state;
        facts.listening = endpoint_.address();
        facts.running = now - start_;
        facts.kernel_dropped = endpoint_.kernel_dropped();
        if (live_) facts.live = live_->summary();
        if (writer_) facts.written = &writer_->written();
        status_.write(std::move(facts), session, now);
    }

    const Options& options_;
    const UdpEndpoint& endpoint_;
    Time start_;
    ProgressLine progress_{!options_.quiet};
    std::optional<LiveView> live_;
    std::optional<PageWriter> writer_;
    StatusFile status_;
    common::ServiceNotification notification_{UdpEndpoint::tell_local};
    std::optional<Time> listed_at_;
    int ticks_ = 0;
};

/// The chosen pages as values.
void take_pages(const Options& options, const Session& session, Reception& reception) {
    const std::vector<Page> pages = session.pages();
    const bool directory = names_directory(options.output);
    for (const Page& page : pages) {
        PageTask task = task_of(page, pages, options.output, options.most_name_bytes);
        if (!directory) task.output = options.output;
        reception.tasks.push_back(std::move(task));
        reception.objects.push_back(RecordStore::snapshot_of(page.best()));
    }
}

Reception receive(const Options& options) {
    GateOptions gate = options.session.gate;
    read_trust(options.trust, gate);
    StartsFile starts(options.trust, gate);
    AgeWarning age_warning;
    const Listening listening = listening_of(options);
    if (listening.description) log_key_hints(*listening.description, options);
    gate.payload_type = listening.payload_type;
    UdpEndpoint endpoint(listening.where);
    spdlog::info("listening on {}", endpoint.address());
    spdlog::debug("receive buffer of {} bytes", endpoint.receive_buffer());
    Session session(options.session, std::move(gate), UdpEndpoint::now());
    session.set_clock(UdpEndpoint::now(), since_1970());
    Reception reception;
    {
        Companions companions(options, endpoint, UdpEndpoint::now());
        const auto on_tick = [&](Time now) {
            session.set_clock(UdpEndpoint::now(), since_1970());
            age_warning.look_at(session.gate());
            companions.on_tick(now, session);
        };
        const auto on_arrival = [&](Time now) {
            starts.update(session.gate().starts());
            companions.on_arrival(now, session);
        };
        endpoint.run(session, on_tick, on_arrival);
        companions.end(session, UdpEndpoint::now(), reception);
    }
    starts.update(session.gate().starts());
    age_warning.look_at(session.gate());
    reception.summary = session.summary(UdpEndpoint::now());
    reception.kernel_dropped = endpoint.kernel_dropped();
    if (options.list) {
        const std::vector<ListedPage> pages = listed_pages(session);
        reception.listed = pages.size();
        if (!pages.empty()) std::fputs(list_text(pages).c_str(), stdout);
        if (options.report) write_list(*options.report, pages);
    }
    take_pages(options, session, reception);
    spdlog::debug("reception ended: {}", to_string(reception.summary.ends_by));
    return reception;
}

extern "C" void note_first_signal(int) {
    constexpr char kNote[] = "\nstill writing what was received; once more to abort\n";
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kNote, sizeof(kNote) - 1);
}

// A Ctrl-C that comes just when reception has ended by itself must not lose what was received; the
// next one aborts. After an interrupted reception the first one does.
void spare_one_signal() {
    struct sigaction action {};
    action.sa_handler = note_first_signal;
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

void warn_of_oddities(const ReportContent& content) {
    if (content.kernel_dropped > 0) {
        spdlog::warn("the kernel dropped {} datagrams: a larger net.core.rmem_max helps",
                     content.kernel_dropped);
    }
    if (content.session.conflicting > 0) {
        spdlog::warn("{} records came with contradictory content", content.session.conflicting);
    }
    if (content.session.store.refused > 0) {
        spdlog::warn("{} records beyond the memory limit were refused",
                     content.session.store.refused);
    }
    if (content.object && !content.object->description) {
        spdlog::warn("no description arrived: name and origin of the model are unknown");
    }
    if (content.session.unverified_dropped > 0) {
        spdlog::warn("{} datagrams were dropped before their signature could be looked at",
                     content.session.unverified_dropped);
    }
    if (content.session.authenticity.is_signed && !content.session.authenticity.verified()) {
        spdlog::warn("the stream is signed, but without --verify nobody knows by whom");
    }
    if (content.object && is_complete(*content.object) && !content.id_verified) {
        spdlog::warn("the object is complete, but its records are not those of its id");
    }
}

ReconstructionOptions reconstruction_options(const Options& options) {
    ReconstructionOptions how;
    how.grid = options.grid;
    how.threads = options.threads;
    how.conceal = options.conceal;
    return how;
}

std::optional<Reconstruction> rebuild(const Options& options, const ReceivedObject& object,
                                      StageClock& clock) {
    ReconstructionOptions how = reconstruction_options(options);
    how.keep_stages = options.stages.has_value();
    ProgressLine progress(!options.quiet);
    how.on_stage = [&](const char* stage) {
        spdlog::debug("stage {}", stage);
        progress.update(fmt::format("rebuilding: {}", stage));
        clock.begin(stage);
    };
    return reconstruct(object, how);
}

/// The pages beside the shown one. What was written of the same records while they were received
/// is what would be written now.
void make_other_pages(const Options& options, const Reception& reception, ReportContent& content) {
    for (std::size_t k = 1; k < reception.tasks.size(); ++k) {
        const PageTask& task = reception.tasks[k];
        const ReceivedObject& object = reception.objects[k];
        const auto written = reception.written.find(task.name);
        if (written != reception.written.end() && written->second.output == task.output &&
            written->second.error.empty() &&
            written->second.is_of(object.id, object.ellipsoids.size(), object.vertices.size(),
                                  task.conflicting)) {
            content.pages.push_back(written->second);
        } else {
            content.pages.push_back(make_page(task, object, reconstruction_options(options)));
        }
        const PageResult& page = content.pages.back();
        if (!page.error.empty()) throw common::ModelError(page.error);
    }
}

bool is_wrong(const PageResult& page) {
    return page.has_mesh && page.judged && !page.topology_as_promised;
}

/// "" or why most of what came was refused.
std::string refusal_text(const RefusalCounts& refused) {
    const auto most = std::max_element(refused.begin(), refused.end());
    if (*most == 0) return "";
    return fmt::format("; {} datagrams were refused as {}", *most,
                       to_string(static_cast<Refusal>(most - refused.begin())));
}

ExitCode verdict(const ReportContent& content) {
    if (!content.object) {
        spdlog::error("nothing received{}", refusal_text(content.session.refused));
        return ExitCode::nothing_received;
    }
    if (!content.reconstruction) {
        spdlog::error("{} vertices but not a single ellipsoid received: nothing to rebuild from",
                      content.object->vertices.size());
        return ExitCode::nothing_received;
    }
    if (std::any_of(content.pages.begin(), content.pages.end(), is_wrong)) {
        return ExitCode::wrong_topology;
    }
    return ExitCode::done;
}

}  // namespace

ExitCode run(const Options& options) {
    check_outputs(options);
    const std::optional<common::TriangleMesh> reference = read_reference(options);

    StageClock clock;
    clock.begin("receive");
    const Reception reception = receive(options);
    if (options.list) {
        if (reception.listed == 0) spdlog::error("nothing received");
        return reception.listed == 0 ? ExitCode::nothing_received : ExitCode::done;
    }
    if (reception.summary.ends_by != EndReason::interrupted) spare_one_signal();
    const ReceivedObject* const object =
        reception.objects.empty() ? nullptr : &reception.objects.front();

    ReportContent content;
    content.session = reception.summary;
    content.kernel_dropped = reception.kernel_dropped;
    content.live = reception.live;
    std::optional<Reconstruction> reconstruction;
    std::optional<common::MeshDistance> quality;
    if (object) {
        content.object = object;
        clock.begin("verify");
        content.id_verified = id_matches(*object);
        reconstruction = rebuild(options, *object, clock);
        content.pages.push_back(reconstruction
                                    ? result_of(reception.tasks.front(), *object, *reconstruction)
                                    : result_of(reception.tasks.front(), *object));
    }
    if (reconstruction) {
        content.reconstruction = &*reconstruction;
        clock.begin("write");
        const std::filesystem::path path = reception.tasks.front().output;
        write_mesh(path, *reconstruction, *object);
        // Whoever watches the live mesh sees the final one at last.
        if (reception.live && options.live && !names_directory(*options.live)) {
            write_mesh(*options.live, *reconstruction, *object);
        }
        if (reconstruction->stages) write_stages(*options.stages, *reconstruction, *object);
        content.output = path.string();
    }
    if (reception.tasks.size() > 1) {
        clock.begin("pages");
        make_other_pages(options, reception, content);
    }
    if (reconstruction && reference) {
        clock.begin("measure");
        quality = common::measure_distance(reconstruction->mesh, *reference,
                                           {.threads = options.threads});
        content.quality = &*quality;
    }
    clock.end();
    content.times = clock.times();

    if (options.report) write_report(*options.report, content);
    warn_of_oddities(content);
    if (!options.quiet) {
        std::fputs(summary_text(content).c_str(), stdout);
        for (std::size_t k = 1; k < content.pages.size(); ++k) {
            std::fputs(page_text(content.pages[k]).c_str(), stdout);
        }
    }
    return verdict(content);
}

}  // namespace ellicast::receiver
