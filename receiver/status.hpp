#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>

#include "common/rate_meter.hpp"
#include "receiver/live_view.hpp"
#include "receiver/page_result.hpp"
#include "receiver/session.hpp"

namespace ellicast::receiver {

/// What a session does not know of itself.
struct StatusFacts {
    std::string state = "receiving";  // waiting, receiving or ended
    std::string listening;
    Time running{};
    std::uint64_t kernel_dropped = 0;
    double recent_rate = 0;  // bits of UDP payload per second
    std::optional<LiveSummary> live;
    const std::map<std::string, PageResult>* written = nullptr;  // by name; may be null
};

/// The JSON of --status:
///   program, version, state, listening
///   seconds    since listening began
///   rate       {recent}: bits of UDP payload per second, of the shown object's streams, over the
///              last five seconds
///   page       name of the one heard last, or null;  round: its number
///   pages      [{name, object_id, version, complete, ellipsoids: {received, expected}, vertices:
///              {received, expected}, output, valid}] of the chosen ones; output, and whether that
///              mesh is a closed manifold: null until written
///   datagrams, records, others, live   as in the report
nlohmann::ordered_json status_json(const StatusFacts& facts, const Session& session, Time now);

/// Keeps the file, about once a second. What goes wrong is said once, in the log.
class StatusFile {
  public:
    explicit StatusFile(std::optional<std::filesystem::path> path) : path_(std::move(path)) {}

    [[nodiscard]] bool wanted() const { return path_.has_value(); }
    /// Whether it is time; moments must not run backwards.
    [[nodiscard]] bool due(Time now) const { return wanted() && now >= next_; }
    /// Fills the rate in and writes.
    void write(StatusFacts facts, const Session& session, Time now);

  private:
    std::optional<std::filesystem::path> path_;
    Time next_{};
    common::RateMeter rate_;
    bool complained_ = false;
};

}  // namespace ellicast::receiver
