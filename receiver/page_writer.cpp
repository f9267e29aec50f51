#include "receiver/page_writer.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <exception>
#include <utility>

#include "receiver/background.hpp"
#include "receiver/output_files.hpp"
#include "receiver/page_files.hpp"

namespace ellicast::receiver {
namespace {

std::size_t conflicts_of(const RecordStore::Group& group) {
    return group.ellipsoids.conflicting() + group.vertices.conflicting();
}

}  // namespace

bool PageSchedule::due(const RecordStore::Group& group, const PageResult* written,
                       std::uint64_t rounds_written) {
    if (group.ellipsoids.size() == 0) return false;
    const bool same = written && written->is_of(group.object, group.ellipsoids.size(),
                                                group.vertices.size(), conflicts_of(group));
    if (same) return false;
    const bool other_object = !written || written->object != group.object;
    return group.complete() || group.progress.rounds_over() > (other_object ? 0 : rounds_written);
}

PageTask task_of(const Page& page, const std::vector<Page>& all,
                 const std::filesystem::path& directory, std::size_t most_name_bytes) {
    // A name of which nothing is left is as good as none.
    const auto called = [&](const Page& other) {
        const bool none = safe_file_stem(other.name, most_name_bytes).empty();
        return none ? id_text(other.best().object) : other.name;
    };
    std::vector<std::string> names;
    names.reserve(all.size());
    for (const Page& other : all) names.push_back(called(other));
    const std::string stem = page_stems(names, most_name_bytes).at(called(page));
    return {page.name, page.version, conflicts_of(page.best()), directory / (stem + ".ply")};
}

PageWriter::PageWriter(PageWriterOptions options) : options_(std::move(options)) {}

PageWriter::~PageWriter() {
    stop_ = true;
    if (pending_.valid()) pending_.wait();
}

void PageWriter::on_tick(Time now, const Session& session) {
    take(now);
    if (pending_.valid() || now < rests_until_) return;
    const std::vector<Page> pages = session.pages();
    for (const Page& page : pages) {
        // A page will soon have a name, or be written under its id at the end.
        if (page.name == id_text(page.best().object)) continue;
        const auto known = written_.find(page.name);
        const PageResult* const written = known == written_.end() ? nullptr : &known->second;
        if (!PageSchedule::due(page.best(), written, rounds_[page.name])) continue;
        start(now, page, pages);
        return;
    }
}

void PageWriter::take(Time now) {
    if (!pending_.valid()) return;
    if (pending_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    const std::optional<PageResult> result = pending_.get();
    rests_until_ = now + (now - begun_);
    if (!result) return;
    if (!result->error.empty()) {
        spdlog::warn("{}", result->error);
    } else {
        spdlog::info("{} written: version {}, {} of {} vertices", result->output.string(),
                     result->version, result->vertices, result->hint.vertices);
    }
    written_.insert_or_assign(result->name, *result);
}

void PageWriter::start(Time now, const Page& page, const std::vector<Page>& all) {
    begun_ = now;
    const RecordStore::Group& group = page.best();
    rounds_[page.name] = group.progress.rounds_over();
    pending_ =
        std::async(std::launch::async,
                   [how = background_options(options_.grid, options_.conceal, stop_),
                    task = task_of(page, all, options_.directory, options_.most_name_bytes),
                    object = RecordStore::snapshot_of(group)]() -> std::optional<PageResult> {
                       try {
                           return make_page(task, object, how);
                       } catch (const Stopped&) {
                           return std::nullopt;
                       } catch (const std::exception& error) {
                           PageResult failed = result_of(task, object);
                           failed.error = error.what();
                           return failed;
                       }
                   });
}

}  // namespace ellicast::receiver
