// receiver/program.cpp
#include "receiver/program.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <optional>
#include <string>

#include "common/mesh_distance.hpp"
#include "common/model_io.hpp"
#include "receiver/output_files.hpp"
#include "receiver/progress.hpp"
#include "receiver/report.hpp"
#include "receiver/stage_clock.hpp"
#include "receiver/udp_endpoint.hpp"

namespace ellicast::receiver {
namespace {

/// What is in hand once reception is over.
struct Reception {
    SessionSummary summary;
    std::uint64_t kernel_dropped = 0;
    std::optional<ReceivedObject> object;
};

void check_outputs(const Options& options) {
    if (names_directory(options.output)) {
        check_writable_directory(options.output);
    } else {
        check_writable_file(options.output);
    }
    if (options.stages) check_writable_directory(*options.stages);
    if (options.report) check_writable_file(*options.report);
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

Reception receive(const Options& options) {
    UdpEndpoint endpoint(options.listen);
    spdlog::info("listening on {}", endpoint.address());
    spdlog::debug("receive buffer of {} bytes", endpoint.receive_buffer());
    Session session(options.session, UdpEndpoint::now());
    {
        ProgressLine progress(!options.quiet);
        int ticks = 0;
        endpoint.run(session, [&](Time now) {
            if (progress.shown() && ++ticks % 2 == 0) progress.update(progress_text(session, now));
        });
    }
    Reception reception;
    reception.summary = session.summary(UdpEndpoint::now());
    reception.kernel_dropped = endpoint.kernel_dropped();
    reception.object = session.store().snapshot();
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
    if (content.object && is_complete(*content.object) && !content.id_verified) {
        spdlog::warn("the object is complete, but its records are not those of its id");
    }
}

std::optional<Reconstruction> rebuild(const Options& options, const ReceivedObject& object,
                                      StageClock& clock) {
    ReconstructionOptions how;
    how.grid = options.grid;
    how.threads = options.threads;
    how.conceal = options.conceal;
    how.keep_stages = options.stages.has_value();
    ProgressLine progress(!options.quiet);
    how.on_stage = [&](const char* stage) {
        spdlog::debug("stage {}", stage);
        progress.update(fmt::format("rebuilding: {}", stage));
        clock.begin(stage);
    };
    return reconstruct(object, how);
}

ExitCode verdict(const ReportContent& content) {
    if (!content.object) {
        spdlog::error("nothing received");
        return ExitCode::nothing_received;
    }
    if (!content.reconstruction) {
        spdlog::error("{} vertices but not a single ellipsoid received: nothing to rebuild from",
                      content.object->vertices.size());
        return ExitCode::nothing_received;
    }
    const Reconstruction& reconstruction = *content.reconstruction;
    const bool wrong = reconstruction.judged && !reconstruction.topology_as_promised;
    return wrong ? ExitCode::wrong_topology : ExitCode::done;
}

}  // namespace

ExitCode run(const Options& options) {
    check_outputs(options);
    const std::optional<common::TriangleMesh> reference = read_reference(options);

    StageClock clock;
    clock.begin("receive");
    const Reception reception = receive(options);
    if (reception.summary.ends_by != EndReason::interrupted) spare_one_signal();

    ReportContent content;
    content.session = reception.summary;
    content.kernel_dropped = reception.kernel_dropped;
    std::optional<Reconstruction> reconstruction;
    std::optional<common::MeshDistance> quality;
    if (reception.object) {
        content.object = &*reception.object;
        clock.begin("verify");
        content.id_verified = id_matches(*reception.object);
        reconstruction = rebuild(options, *reception.object, clock);
    }
    if (reconstruction) {
        content.reconstruction = &*reconstruction;
        clock.begin("write");
        const auto path = output_file(options.output, *reception.object);
        write_mesh(path, *reconstruction, *reception.object);
        if (reconstruction->stages)
            write_stages(*options.stages, *reconstruction, *reception.object);
        content.output = path.string();
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
    if (!options.quiet) std::fputs(summary_text(content).c_str(), stdout);
    return verdict(content);
}

}  // namespace ellicast::receiver
