// tests/receiver/live_worker_test.cpp
#include "receiver/live_worker.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>

using namespace ellicast::receiver;

namespace {

/// The update, once it is there.
LiveUpdate await(LiveWorker& worker) {
    for (;;) {
        if (const auto update = worker.take()) return *update;
        std::this_thread::yield();
    }
}

ReceivedObject object_of(std::size_t vertices) {
    ReceivedObject object;
    object.vertices.resize(vertices);
    return object;
}

}  // namespace

TEST_CASE("a worker hands back what its work made of the snapshot, once") {
    LiveWorker worker([](const ReceivedObject& object, const std::atomic<bool>&) {
        LiveUpdate update;
        update.vertices = object.vertices.size();
        return update;
    });
    CHECK_FALSE(worker.take());
    for (const std::size_t vertices : {3u, 5u}) {
        worker.start(object_of(vertices));
        CHECK(await(worker).vertices == vertices);
        CHECK_FALSE(worker.take());
    }
}

TEST_CASE("whoever asks a worker for its update is not kept waiting") {
    std::promise<void> go;
    LiveWorker worker([&](const ReceivedObject&, const std::atomic<bool>&) {
        go.get_future().wait();
        return LiveUpdate{};
    });
    worker.start(object_of(1));
    CHECK_FALSE(worker.take());
    go.set_value();
    await(worker);
}

TEST_CASE("what the work throws is the update's error, and the worker goes on") {
    bool fail = true;
    LiveWorker worker([&](const ReceivedObject&, const std::atomic<bool>&) -> LiveUpdate {
        if (fail) throw std::runtime_error("no room");
        return {};
    });
    worker.start(object_of(1));
    CHECK(await(worker).error == "no room");
    fail = false;
    worker.start(object_of(1));
    CHECK(await(worker).error.empty());
}

TEST_CASE("a worker that goes tells its work to stop, and waits for it") {
    std::atomic<bool> left{false};
    {
        LiveWorker worker([&](const ReceivedObject&, const std::atomic<bool>& stop) {
            while (!stop) std::this_thread::yield();
            left = true;
            return LiveUpdate{};
        });
        worker.start(object_of(1));
    }
    CHECK(left);
}
