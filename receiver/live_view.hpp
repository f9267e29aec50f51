// receiver/live_view.hpp
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "receiver/live_schedule.hpp"
#include "receiver/live_worker.hpp"
#include "receiver/session.hpp"

namespace ellicast::receiver {

/// Where live meshes go, and how they are made.
struct LiveOptions {
    std::optional<std::filesystem::path> file;  // the current one; in a directory one of each page
    std::optional<std::filesystem::path> series;  // directory: all of them, numbered
    Time interval = std::chrono::milliseconds(500);
    int grid = 96;
    bool conceal = true;
    std::size_t most_name_bytes = 100;

    /// Whether anybody gets a live mesh.
    [[nodiscard]] bool wanted() const { return interval > Time::zero() && (file || series); }
};

/// What the report says of live meshes; times since the first datagram.
struct LiveSummary {
    std::size_t updates = 0;
    Time first_shape{};
    Time last_shape{};
    std::size_t last_vertices = 0;
    std::size_t last_records = 0;
};

/// Keeps a current mesh on disk while datagrams arrive. The final mesh does not depend on it.
class LiveView {
  public:
    /// Requires options.wanted() (asserted).
    explicit LiveView(const LiveOptions& options);

    /// Takes a finished mesh's news in and begins the next one when it is due. Call it after
    /// arrivals, and a few times a second. Cost: a copy of the shown records when one begins.
    void on_arrival(Time now, const Session& session);

    [[nodiscard]] const LiveSummary& summary() const { return summary_; }

    /// The mesh in the making: where it goes, and which it is.
    struct Task {
        std::filesystem::path file;
        LiveStep step = LiveStep::mesh;
    };

  private:
    struct Subject {
        const RecordStore::Group* group = nullptr;
        std::filesystem::path file;
    };
    [[nodiscard]] Subject subject_of(const Session& session) const;
    void take_update();

    LiveOptions options_;
    LiveSchedule schedule_;
    std::optional<Time> first_datagram_;
    LiveSummary summary_;
    bool complained_ = false;
    std::shared_ptr<Task> task_ = std::make_shared<Task>();  // read by the worker at work
    LiveWorker worker_;
};

}  // namespace ellicast::receiver
