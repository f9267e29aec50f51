// sender/packing_ahead.hpp: private to sender/udp_endpoint.
#pragma once

#include <atomic>
#include <exception>
#include <thread>
#include <vector>

#include "sender/session.hpp"

namespace ellicast::sender {

/// Has a thread of its own make the datagrams of an unpaced session, so that one batch is made
/// while the one before leaves. From the first take() to settle(), and again to the next settle(),
/// the session belongs to that thread: nobody else may touch it. Throws what polling throws.
class PackingAhead {
  public:
    /// The session must live as long.
    explicit PackingAhead(Session& session);
    ~PackingAhead();
    PackingAhead(const PackingAhead&) = delete;
    PackingAhead& operator=(const PackingAhead&) = delete;

    struct Batch {
        std::vector<Datagram> datagrams;
        bool last = false;  // the session was done with these
    };
    /// The next datagrams, some hundreds; has those after them begun with, in the memory of
    /// `spent`. Not to be called after the last.
    Batch take(Time now, std::vector<Datagram> spent);

    /// Waits until the session is at rest: it may be asked and changed until the next take().
    void settle();

  private:
    enum class State { idle, working, ready, stopping };
    void begin(Time now, std::vector<Datagram> spent);
    void work();

    Session& session_;
    std::atomic<State> state_{State::idle};
    // Whose they are is what the state says.
    Time now_{};
    Batch batch_;
    std::exception_ptr failure_;
    std::jthread thread_;  // last, for it uses all of these
};

}  // namespace ellicast::sender
