#include "sender/model_watch.hpp"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <cassert>
#include <chrono>
#include <exception>
#include <utility>

#include "common/low_priority.hpp"

namespace ellicast::sender {
namespace {

namespace fs = std::filesystem;

// How long a file must have been left alone before it is read: whoever copies one writes more
// often.
constexpr auto kRest = std::chrono::milliseconds(200);
constexpr int kMostRests = 50;  // then it is tried at the next look

}  // namespace

std::optional<FileStamp> stamp_of(const fs::path& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) return std::nullopt;
    return FileStamp{info.st_dev, info.st_ino, static_cast<std::uint64_t>(info.st_size),
                     std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

/// What both threads see. The watch's own fields below are its thread's alone.
struct ModelWatch::Shared {
    std::mutex mutex;
    std::condition_variable wake;
    bool stop = false;
    bool wanted = false;
    bool all = false;
    bool busy = false;
    std::vector<FreshPage> fresh;
    std::vector<RoundPlan> waste;

    std::vector<fs::path> paths;
    std::vector<std::optional<FileStamp>> stamps;  // as last looked at
    std::vector<protocol::ObjectId> objects;
    Load load;

    void run();
    void look_at(std::size_t page, bool even_if_same);
    std::optional<FileStamp> rested_stamp(std::size_t page);
    void read_again(std::size_t page);
};

void ModelWatch::Shared::run() {
    common::lower_priority();
    std::unique_lock lock(mutex);
    for (;;) {
        wake.wait(lock, [&] { return stop || wanted || !waste.empty(); });
        if (stop) return;
        std::vector<RoundPlan> rubbish = std::exchange(waste, {});
        const bool look = std::exchange(wanted, false);
        const bool every = std::exchange(all, false);
        busy = true;
        lock.unlock();
        rubbish.clear();
        for (std::size_t page = 0; look && page < paths.size(); ++page) look_at(page, every);
        lock.lock();
        busy = false;
    }
}

void ModelWatch::Shared::look_at(std::size_t page, bool even_if_same) {
    std::optional<FileStamp> stamp = stamp_of(paths[page]);
    if (stamp == stamps[page] && !even_if_same) return;
    if (stamp && stamp != stamps[page]) stamp = rested_stamp(page);
    const bool news = stamp != stamps[page];
    if (!stamp) {
        if (news || even_if_same) {
            spdlog::warn("{}: cannot be read any more; the page stays as it is",
                         paths[page].string());
        }
        stamps[page] = stamp;
        return;
    }
    stamps[page] = stamp;
    read_again(page);
}

/// The file's stamp once nobody has written to it for a while.
std::optional<FileStamp> ModelWatch::Shared::rested_stamp(std::size_t page) {
    std::optional<FileStamp> stamp = stamp_of(paths[page]);
    for (int rest = 0; rest < kMostRests; ++rest) {
        std::unique_lock lock(mutex);
        if (wake.wait_for(lock, kRest, [&] { return stop; })) break;
        lock.unlock();
        const std::optional<FileStamp> later = stamp_of(paths[page]);
        if (later == stamp) return stamp;
        stamp = later;
    }
    return stamps[page];  // as if nothing had happened
}

void ModelWatch::Shared::read_again(std::size_t page) {
    {
        const std::lock_guard lock(mutex);
        if (stop) return;
    }
    try {
        FreshPage made = load(page);
        if (made.plan.object().id == objects[page]) {
            spdlog::info("{}: the object is the same as before", paths[page].string());
            return;
        }
        objects[page] = made.plan.object().id;
        const std::lock_guard lock(mutex);
        fresh.push_back(std::move(made));
    } catch (const std::exception& error) {
        spdlog::warn("{}; the page stays as it is", error.what());
    }
}

ModelWatch::ModelWatch(std::vector<fs::path> paths, std::vector<std::optional<FileStamp>> stamps,
                       std::vector<protocol::ObjectId> objects, Load load)
    : shared_(std::make_shared<Shared>()) {
    assert(paths.size() == stamps.size() && paths.size() == objects.size());
    shared_->paths = std::move(paths);
    shared_->stamps = std::move(stamps);
    shared_->objects = std::move(objects);
    shared_->load = std::move(load);
    thread_ = std::thread([shared = shared_] { shared->run(); });
}

ModelWatch::~ModelWatch() {
    bool at_work = false;
    {
        const std::lock_guard lock(shared_->mutex);
        shared_->stop = true;
        at_work = shared_->busy;
        shared_->wake.notify_all();
    }
    if (at_work) {
        thread_.detach();
    } else {
        thread_.join();
    }
}

void ModelWatch::check(bool all) {
    const std::lock_guard lock(shared_->mutex);
    shared_->wanted = true;
    shared_->all = shared_->all || all;
    shared_->wake.notify_all();
}

std::vector<FreshPage> ModelWatch::take() {
    const std::lock_guard lock(shared_->mutex);
    return std::exchange(shared_->fresh, {});
}

void ModelWatch::discard(std::vector<RoundPlan> plans) {
    const std::lock_guard lock(shared_->mutex);
    for (RoundPlan& plan : plans) shared_->waste.push_back(std::move(plan));
    shared_->wake.notify_all();
}

bool ModelWatch::busy() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->busy;
}

}  // namespace ellicast::sender
