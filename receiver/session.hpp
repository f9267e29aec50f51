// receiver/session.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/loss_model.hpp"
#include "receiver/arrival.hpp"
#include "receiver/catalogue.hpp"
#include "receiver/datagram_gate.hpp"
#include "receiver/pages.hpp"
#include "receiver/received_object.hpp"
#include "receiver/record_store.hpp"
#include "receiver/simulated_loss.hpp"
#include "receiver/stream_statistics.hpp"

namespace ellicast::receiver {

/// When reception ends by itself (DESIGN section 5); all of it about the chosen pages: the shown
/// object alone, or all of several. Each but
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
    Time idle_timeout = std::chrono::seconds(3);  // after the last valid datagram
    std::optional<Time> wait;  // for the first valid datagram; empty: without end
    StoreLimits limits;
    PageChoice pages;
    GateOptions gate;
    common::ImpairmentOptions loss;  // simulated on what the gate lets in
};

/// What a session can say of itself at any time.
struct SessionSummary {
    EndReason ends_by = EndReason::none;
    StreamCounts datagrams;  // of the shown object's streams
    MalformedCounts malformed;
    RefusalCounts refused{};               // by the gate
    std::uint64_t unverified_dropped = 0;  // by the gate, for want of room
    Authenticity authenticity;             // of the shown object
    StoreCounts store;
    std::size_t conflicting = 0;        // indices of the shown object with contradictory records
    std::size_t other_groups = 0;       // beside the chosen pages: strangers, other objects
    std::uint64_t other_datagrams = 0;  // of those groups
    std::uint64_t contradictory_hints =
        0;  // of these, datagrams with the shown id and another hint
};

/// The receiving end without sockets, clock and geometry: datagrams and moments in, records and
/// counts out. Pure and single-threaded; moments must not run backwards.
class Session {
  public:
    /// Listens from `now` on.
    Session(const SessionOptions& options, Time now) : Session(options, options.gate, now) {}
    /// With another gate than that of the options.
    Session(const SessionOptions& options, GateOptions gate, Time now);
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;
    ~Session() = default;

    /// Takes one datagram in, whatever it is. Ignored once finished. Cost: see RecordStore::accept.
    /// Where signatures are verified it has to wait for work() or poll().
    void on_datagram(Time now, const Source& source, std::span<const std::uint8_t> bytes);

    /// Verifies some of the datagrams that wait (DatagramGate::work). True when more do: take in
    /// what has arrived, and call it again.
    bool work();

    /// What the local clock showed at `now`, for GateOptions::max_age.
    void set_clock(Time now, std::chrono::microseconds since_1970) {
        gate_.set_clock(now, since_1970);
    }

    /// Lets time pass, and works; call it at next_wakeup() at the latest.
    void poll(Time now);

    /// When poll is needed even if nothing arrives; empty: never.
    [[nodiscard]] std::optional<Time> next_wakeup() const;

    /// Ends reception, keeping what was received. Nothing happens once finished.
    void interrupt(Time now);

    [[nodiscard]] bool finished() const { return ends_by_ != EndReason::none; }
    [[nodiscard]] EndReason ends_by() const { return ends_by_; }
    [[nodiscard]] const RecordStore& store() const { return store_; }
    /// When the first valid datagram arrived; empty before.
    [[nodiscard]] std::optional<Time> first_heard() const { return first_heard_; }
    [[nodiscard]] const Catalogue& catalogue() const { return catalogue_; }
    /// See chosen_pages(). Invalid after the next call that is not const.
    [[nodiscard]] std::vector<Page> pages() const;
    /// The best version of the first page; null before there is one.
    [[nodiscard]] const RecordStore::Group* shown() const;
    [[nodiscard]] const DatagramGate& gate() const { return gate_; }
    [[nodiscard]] SessionSummary summary(Time now) const;

  private:
    struct Deadline {
        Time at{};
        EndReason reason = EndReason::none;
    };
    void admit(Time now, const Source& source, std::span<const std::uint8_t> clear);
    void deliver(Time now, const Source& source, std::span<const std::uint8_t> bytes);
    [[nodiscard]] bool ends_when_complete() const;
    void look_for_completion(Time now);
    void forget_outdated();
    [[nodiscard]] bool is_page_beside(const RecordStore::Group& shown,
                                      const RecordStore::Group& group) const;
    [[nodiscard]] Time last_heard(const RecordStore::Group& shown) const;
    [[nodiscard]] std::optional<Deadline> next_deadline() const;
    void finish(Time now, EndReason reason);

    SessionOptions options_;
    Time start_;
    Time last_arrival_;
    std::optional<Time> first_heard_;
    EndReason ends_by_ = EndReason::none;
    DatagramGate gate_;
    DatagramGate::Deliver admit_;  // calls admit()
    std::optional<SimulatedLoss> loss_;
    RecordStore store_;
    Catalogue catalogue_;
    std::uint64_t looked_at_ = 0;  // changes of both
    StreamTable streams_;
    MalformedCounts malformed_;
};

}  // namespace ellicast::receiver
