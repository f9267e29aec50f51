#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "receiver/arrival.hpp"

namespace ellicast::receiver {

/// A datagram as it came; refers to bytes that somebody else keeps.
struct Arrival {
    Time time{};  // at which the kernel took it
    Source source;
    std::span<const std::uint8_t> bytes;
};

/// Datagrams on their way from the thread that takes them out of the socket to the one that reads
/// them: first in, first out, in memory of a fixed size. One thread puts in, one takes out; neither
/// waits, locks or allocates.
class DatagramRing {
  public:
    /// No UDP payload is larger.
    static constexpr std::size_t kMaxDatagram = std::size_t{1} << 16;
    /// What holds one of these wherever it begins.
    static constexpr std::size_t kLeastBytes = 2 * (kMaxDatagram + 256);

    /// Memory for datagrams and a few dozen bytes with each; requires kLeastBytes or more
    /// (asserted). Pages that were never used take no memory: with rewind() those are as many as
    /// never waited at one time.
    explicit DatagramRing(std::size_t bytes);

    // For the thread that puts in:

    /// Copies a datagram in. False, and nothing changed, when there is no room. Others see it from
    /// the next publish() on. Requires at most kMaxDatagram bytes (asserted).
    [[nodiscard]] bool push(const Arrival& arrival);
    void publish() { written_.store(write_, std::memory_order_release); }
    /// Goes back to the front of the memory, which is in the cache still, if all was taken.
    /// Requires that all that was put in is published.
    void rewind();

    // For the thread that takes out:

    /// Calls visit(arrival) for up to `most` datagrams while it gives true, and frees their room
    /// afterwards. Gives their number.
    template <class Visit>
    std::size_t take(std::size_t most, Visit&& visit) {
        const std::uint64_t end = written_.load(std::memory_order_acquire);
        std::uint64_t at = read_.load(std::memory_order_relaxed);
        if (at == end) return 0;
        if (at == jump_from_) at = jump_to_;
        std::size_t taken = 0;
        for (bool more = true; more && taken < most && at != end; ++taken) {
            Arrival arrival;
            at = next(at, arrival);
            more = visit(arrival);
        }
        read_.store(at, std::memory_order_release);
        return taken;
    }
    [[nodiscard]] bool empty() const {
        return written_.load(std::memory_order_acquire) == read_.load(std::memory_order_relaxed);
    }

  private:
    struct Head {
        Time time{};
        decltype(Source::address) address{};  // nothing that arrives was verified yet
        std::uint16_t port = 0;
        std::uint32_t size = 0;  // kSkip: nothing more until the memory's end
    };
    static constexpr std::size_t kLine = 64;         // bytes of a cache line
    static constexpr std::size_t kUnit = 2 * kLine;  // everything begins at a multiple of it

    [[nodiscard]] static std::size_t room_for(std::size_t bytes);
    [[nodiscard]] std::uint8_t* place(std::uint64_t position) const;
    [[nodiscard]] std::size_t until_end(std::uint64_t position) const;
    std::uint64_t next(std::uint64_t at, Arrival& arrival) const;
    [[nodiscard]] std::uint64_t position_read() const;

    // Positions count all bytes ever put in or taken out.
    std::size_t size_;
    std::unique_ptr<std::uint8_t[]> bytes_;
    std::uint64_t write_ = 0;       // the putting thread's own
    std::uint64_t read_known_ = 0;  // likewise: a position that read_ has passed
    // The latest rewind, for whoever stands where it began. Seen with what is published next, and
    // not touched until that was taken.
    std::uint64_t jump_from_ = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t jump_to_ = 0;
    alignas(kLine) std::atomic<std::uint64_t> written_{0};
    alignas(kLine) std::atomic<std::uint64_t> read_{0};
};

}  // namespace ellicast::receiver
