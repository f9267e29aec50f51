// receiver/live_view.cpp
#include "receiver/live_view.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cassert>
#include <memory>
#include <utility>
#include <vector>

#include "common/low_priority.hpp"
#include "receiver/background.hpp"
#include "receiver/output_files.hpp"
#include "receiver/page_writer.hpp"
#include "receiver/reconstruction.hpp"
#include "receiver/sketch.hpp"
#include "receiver/udp_endpoint.hpp"

namespace ellicast::receiver {
namespace {

// Enough to know a horse by, and a few milliseconds.
constexpr int kSketchCells = 48;

ReceivedObject without_vertices(const ReceivedObject& object) {
    ReceivedObject rest;
    rest.id = object.id;
    rest.hint = object.hint;
    rest.description = object.description;
    rest.ellipsoid_index = object.ellipsoid_index;
    rest.ellipsoids = object.ellipsoids;
    return rest;
}

std::optional<Reconstruction> make_mesh(const LiveOptions& options, LiveStep step,
                                        const ReceivedObject& object,
                                        const std::atomic<bool>& stop) {
    const ReconstructionOptions how = background_options(options.grid, options.conceal, stop);
    if (step == LiveStep::mesh) return reconstruct(object, how);
    if (step == LiveStep::coarse) return reconstruct(without_vertices(object), how);
    return sketch(object, std::min(options.grid, kSketchCells), how.threads);
}

LiveUpdate make_update(const LiveOptions& options, const LiveView::Task& task, std::size_t number,
                       const ReceivedObject& object, const std::atomic<bool>& stop) {
    if (task.step == LiveStep::mesh) common::lower_priority();  // the thread has this one task
    LiveUpdate update;
    update.records = object.ellipsoids.size() + object.vertices.size();
    const auto reconstruction = make_mesh(options, task.step, object, stop);
    if (reconstruction && !stop) {
        update.vertices = reconstruction->mesh.positions.size();
        if (options.file) write_mesh(task.file, *reconstruction, object);
        if (options.series) {
            write_mesh(*options.series / fmt::format("{:05}.ply", number), *reconstruction, object);
        }
    }
    update.finished = UdpEndpoint::now();
    return update;
}

LiveWorker::Work work_of(const LiveOptions& options, std::shared_ptr<const LiveView::Task> task) {
    // Numbers are the worker's own: it makes one mesh at a time.
    return [options, task = std::move(task), made = std::make_shared<std::size_t>(0)](
               const ReceivedObject& object, const std::atomic<bool>& stop) {
        return make_update(options, *task, ++*made, object, stop);
    };
}

}  // namespace

LiveView::LiveView(const LiveOptions& options)
    : options_(options), schedule_(options.interval), worker_(work_of(options, task_)) {
    assert(options.wanted());
}

void LiveView::on_arrival(Time now, const Session& session) {
    take_update();
    if (schedule_.busy()) return;
    const auto [group, file] = subject_of(session);
    if (!group) return;
    if (!first_datagram_) first_datagram_ = session.first_heard();
    const LiveSubject subject{group->object, group->ellipsoids.size(), group->hint.ellipsoids,
                              group->records()};
    const LiveStep step = schedule_.due(now, subject);
    if (step == LiveStep::none) return;
    // The clock goes on while a batch is taken in; what the mesh took is counted from here.
    schedule_.begin(UdpEndpoint::now(), step, subject);
    *task_ = {file, step};
    worker_.start(RecordStore::snapshot_of(*group));
}

/// The shown object; where pages have files of their own, that of the page heard last.
LiveView::Subject LiveView::subject_of(const Session& session) const {
    const std::vector<Page> pages = session.pages();
    if (pages.empty()) return {};
    const bool each = options_.file && names_directory(*options_.file);
    if (!each) {
        return {&pages.front().best(), options_.file.value_or(std::filesystem::path())};
    }
    const RecordStore::Group* const latest = session.store().latest();
    for (const Page& page : pages) {
        if (&page.current() != latest) continue;
        return {&page.best(),
                task_of(page, pages, *options_.file, options_.most_name_bytes).output};
    }
    return {};
}

void LiveView::take_update() {
    const std::optional<LiveUpdate> update = worker_.take();
    if (!update) return;
    schedule_.end(UdpEndpoint::now());
    if (!update->error.empty()) {
        if (!complained_) spdlog::warn("no live mesh: {}", update->error);
        complained_ = true;
        return;
    }
    if (update->vertices == 0) return;
    const Time since = update->finished - *first_datagram_;
    if (summary_.updates++ == 0) summary_.first_shape = since;
    summary_.last_shape = since;
    summary_.last_vertices = update->vertices;
    summary_.last_records = update->records;
}

}  // namespace ellicast::receiver
