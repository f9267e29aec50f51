// receiver/session.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/loss_model.hpp"
#include "receiver/arrival.hpp"
#include "receiver/received_object.hpp"
#include "receiver/record_store.hpp"
#include "receiver/simulated_loss.hpp"
#include "receiver/stream_statistics.hpp"

namespace ellicast::receiver {

/// When reception ends by itself (DESIGN section 5); all of it about the shown object. Each but
/// `forever` also ends when its sender fell silent for the idle timeout.
enum class Until : std::uint8_t {
    end,       // complete, or 250 ms after the last datagram of the last round
    complete,  // every record is there
    round,     // complete, or a round heard from its start is over, or the stream's end as above
    forever    // never
};

enum class EndReason : std::uint8_t {
    none,        // still receiving
    complete,    // every record is there
    stream_end,  // the last datagram of the last round was seen
    round,       // one full round was heard
    idle,        // nothing valid came any more
    waited,      // nothing valid ever came
    interrupted  // the user's wish
};
/// As the report says it: "complete", "stream_end", ...
std::string_view to_string(EndReason reason);

struct SessionOptions {
    Until until = Until::end;
    Time idle_timeout = std::chrono::seconds(2);  // after the last valid datagram
    std::optional<Time> wait;  // for the first valid datagram; empty: without end
    StoreLimits limits;
    common::ImpairmentOptions loss;  // simulated on what arrives
};

/// What a session can say of itself at any time.
struct SessionSummary {
    EndReason ends_by = EndReason::none;
    StreamCounts datagrams;  // of the shown object's streams
    MalformedCounts malformed;
    StoreCounts store;
    std::size_t conflicting = 0;        // indices of the shown object with contradictory records
    std::size_t other_groups = 0;       // strangers, other objects
    std::uint64_t other_datagrams = 0;  // of those groups
    std::uint64_t contradictory_hints =
        0;  // of these, datagrams with the shown id and another hint
};

/// The receiving end without sockets, clock and geometry: datagrams and moments in, records and
/// counts out. Pure and single-threaded; moments must not run backwards.
class Session {
  public:
    /// Listens from `now` on.
    Session(const SessionOptions& options, Time now);

    /// Takes one datagram in, whatever it is. Ignored once finished. Cost: see RecordStore::accept.
    void on_datagram(Time now, const Source& source, std::span<const std::uint8_t> bytes);

    /// Lets time pass; call it at next_wakeup() at the latest.
    void poll(Time now);

    /// When poll is needed even if nothing arrives; empty: never.
    [[nodiscard]] std::optional<Time> next_wakeup() const;

    /// Ends reception, keeping what was received. Nothing happens once finished.
    void interrupt(Time now);

    [[nodiscard]] bool finished() const { return ends_by_ != EndReason::none; }
    [[nodiscard]] EndReason ends_by() const { return ends_by_; }
    [[nodiscard]] const RecordStore& store() const { return store_; }
    [[nodiscard]] SessionSummary summary(Time now) const;

  private:
    struct Deadline {
        Time at{};
        EndReason reason = EndReason::none;
    };
    void deliver(Time now, const Source& source, std::span<const std::uint8_t> bytes);
    [[nodiscard]] bool ends_when_complete() const;
    [[nodiscard]] std::optional<Deadline> next_deadline() const;
    void finish(Time now, EndReason reason);

    SessionOptions options_;
    Time start_;
    Time last_arrival_;
    EndReason ends_by_ = EndReason::none;
    std::optional<SimulatedLoss> loss_;
    RecordStore store_;
    StreamTable streams_;
    MalformedCounts malformed_;
};

}  // namespace ellicast::receiver
