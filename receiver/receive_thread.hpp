// receiver/receive_thread.hpp: private to receiver/udp_endpoint.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "receiver/datagram_ring.hpp"

namespace ellicast::receiver {

/// Takes datagrams out of a UDP socket as they come, each with the time at which the kernel took
/// it, and does nothing else, so that the kernel's buffer stays empty while others are busy. When
/// its own memory is full it waits: then they stay with the kernel, which counts what it has to
/// drop.
class ReceiveThread {
  public:
    /// Starts. `socket` is bound and stays open while this lives; where it has
    /// SO_TIMESTAMPNS that time counts. Calls `on_news`, from its own thread, when datagrams have
    /// come and the news before is settled.
    ReceiveThread(int socket, std::function<void()> on_news);
    /// Ends; what was not taken is lost.
    ~ReceiveThread();
    ReceiveThread(const ReceiveThread&) = delete;
    ReceiveThread& operator=(const ReceiveThread&) = delete;

    /// Calls visit(arrival) for up to `most` datagrams while it gives true.
    template <class Visit>
    void take(std::size_t most, Visit&& visit) {
        ring_.take(most, visit);
    }
    /// After news: false when all was taken, and news will be told again; true when there is more
    /// to take and to settle, for there will be no news of it.
    [[nodiscard]] bool unsettled();

    /// True when every datagram that had reached the socket by now was taken.
    [[nodiscard]] bool caught_up() const;

  private:
    class Batch;
    void run();
    void take_in(Batch& batch, std::size_t count);
    void tell();
    void wait_for_datagrams() const;
    void wait_for_room() const;

    int socket_;
    std::function<void()> on_news_;
    DatagramRing ring_;
    int wish_to_stop_;   // an eventfd
    Time socket_empty_;  // it was, then; the thread's alone
    std::atomic<bool> stop_{false};
    std::atomic<bool> in_hand_{false};  // datagrams between the socket and the ring
    std::atomic<bool> told_{false};     // news, and it is not settled
    std::thread thread_;
};

}  // namespace ellicast::receiver
