// receiver/live_worker.cpp
#include "receiver/live_worker.hpp"

#include <cassert>
#include <chrono>
#include <exception>
#include <utility>

namespace ellicast::receiver {

LiveWorker::~LiveWorker() {
    stop_ = true;
    if (pending_.valid()) pending_.wait();
}

void LiveWorker::start(ReceivedObject object) {
    assert(!pending_.valid());
    pending_ = std::async(std::launch::async, [this, snapshot = std::move(object)] {
        try {
            return work_(snapshot, stop_);
        } catch (const std::exception& error) {
            LiveUpdate failed;
            failed.error = error.what();
            return failed;
        }
    });
}

std::optional<LiveUpdate> LiveWorker::take() {
    if (!pending_.valid()) return std::nullopt;
    if (pending_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        return std::nullopt;
    }
    return pending_.get();
}

}  // namespace ellicast::receiver
