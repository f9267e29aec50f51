#pragma once

#include <cstddef>
#include <vector>

#include "protocol/datagram.hpp"
#include "receiver/arrival.hpp"

namespace ellicast::receiver {

/// What a live mesh could be made of now.
struct LiveSubject {
    protocol::ObjectId object{};
    std::size_t ellipsoids = 0;  // received
    std::size_t expected = 0;    // of them
    std::size_t records = 0;     // received, of both kinds
};

enum class LiveStep {
    none,
    sketch,  // the ellipsoids alone, quickly
    coarse,  // the ellipsoids alone, as the first stage of a whole mesh takes them
    mesh     // all that is there
};

/// When the next live mesh is begun, and which. At most one is in the making. A new object is
/// sketched from its first ellipsoid on, again whenever there are twice as many, and when all are
/// there; until there is a whole mesh of it, and with rests as long as each sketch took. From half
/// of the ellipsoids on coarse meshes take the place of sketches: ten times the work (horse: 0.1
/// s), but of the promised topology, and ten times nearer (8e-4 of the diagonal, not 80e-4). Whole
/// meshes go before both, and begin when there are other records than the last mesh was made of, no
/// sooner than `interval` after the first sketch or the last whole mesh began, and no sooner after
/// the last one's end than that took: so live meshes take at most half of one core's time. The last
/// kMostObjects objects are remembered, so that a page that comes again is not sketched again.
/// Pure; moments must not run backwards.
class LiveSchedule {
  public:
    /// Requires interval > 0 (asserted).
    explicit LiveSchedule(Time interval);

    /// What to begin now.
    [[nodiscard]] LiveStep due(Time now, const LiveSubject& subject) const;
    /// Requires that none is in the making, and a step (asserted).
    void begin(Time now, LiveStep step, const LiveSubject& subject);
    /// Requires that one is (asserted).
    void end(Time now);

    [[nodiscard]] bool busy() const { return busy_; }

  private:
    static constexpr std::size_t kMostObjects = 64;
    struct Known {
        LiveSubject subject;             // as it was when the last one of it began
        LiveStep step = LiveStep::none;  // the last one's
        Time next_mesh{};
    };
    [[nodiscard]] const Known* known(const protocol::ObjectId& object) const;
    static LiveStep quick_step(const Known& known, const LiveSubject& subject);

    Time interval_;
    bool busy_ = false;
    Time begun_{};
    Time rests_until_{};
    std::vector<Known> known_;  // the latest last
};

}  // namespace ellicast::receiver
