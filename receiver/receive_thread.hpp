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
/// drop. As soon as it does not keep up it has the kernel hand over neighbours of equal size in one
/// piece (UDP_GRO), which is several times cheaper where network or sender bring them so; not
/// before, for filters and captures of this host then see such a piece as one packet.
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

    /// What came out of the socket so far. The kernel counts pieces when it drops.
    struct Taken {
        std::uint64_t datagrams = 0;
        std::uint64_t pieces = 0;
    };
    [[nodiscard]] Taken taken() const { return {datagrams_, pieces_}; }

  private:
    class Batch;
    void run();
    void ask_for_pieces(std::size_t count);
    void take_in(Batch& batch, std::size_t count);
    bool put_in(const Arrival& arrival);
    void tell();
    void wait_for_datagrams() const;
    void wait_for_room() const;

    int socket_;
    std::function<void()> on_news_;
    DatagramRing ring_;
    int wish_to_stop_;      // an eventfd
    int full_batches_ = 0;  // in a row; the thread's alone
    Time socket_empty_;     // it was, then; the thread's alone
    std::atomic<bool> stop_{false};
    std::atomic<bool> in_hand_{false};  // datagrams between the socket and the ring
    std::atomic<bool> told_{false};     // news, and it is not settled
    std::atomic<std::uint64_t> datagrams_{0};
    std::atomic<std::uint64_t> pieces_{0};
    std::thread thread_;
};

}  // namespace ellicast::receiver
