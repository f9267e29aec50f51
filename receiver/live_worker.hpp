// receiver/live_worker.hpp
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "receiver/arrival.hpp"
#include "receiver/received_object.hpp"

namespace ellicast::receiver {

/// What became of one live mesh.
struct LiveUpdate {
    Time finished{};
    std::size_t records = 0;   // that it was made of
    std::size_t vertices = 0;  // of the mesh; 0: none could be made
    std::string error;         // why it was not written; empty: it was
};

/// Makes live meshes on a thread of its own, one at a time, out of snapshots that it owns. Never
/// blocks the caller, but for its destructor, which waits until the work heeds the wish to stop.
class LiveWorker {
  public:
    /// `work` runs on the other thread and should return early when `stop` becomes true. What it
    /// throws becomes the update's error.
    using Work = std::function<LiveUpdate(const ReceivedObject&, const std::atomic<bool>& stop)>;
    explicit LiveWorker(Work work) : work_(std::move(work)) {}
    ~LiveWorker();
    LiveWorker(const LiveWorker&) = delete;
    LiveWorker& operator=(const LiveWorker&) = delete;

    /// Requires that nothing is in flight: a start whose update was not taken yet (asserted).
    void start(ReceivedObject object);
    /// The update that has become ready since; empty when there is none.
    [[nodiscard]] std::optional<LiveUpdate> take();

  private:
    Work work_;
    std::atomic<bool> stop_{false};
    std::future<LiveUpdate> pending_;
};

}  // namespace ellicast::receiver
