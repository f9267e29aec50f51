// sender/batch_sending.hpp: private to sender/udp_endpoint.
#pragma once

#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ellicast::sender {

/// Hands many datagrams to a connected UDP socket with few system calls: sendmmsg, and, where the
/// kernel can, neighbours of equal size as one buffer which it (or the network card) cuts up again
/// (UDP_SEGMENT). Receivers see the same datagrams either way, but filters, counters and queues of
/// this host see such a run as one packet.
class BatchSending {
  public:
    using Datagram = std::vector<std::uint8_t>;

    explicit BatchSending(bool segments) : segments_(segments) {}

    struct Progress {
        std::size_t datagrams = 0;  // taken by the operating system, the first of those offered
        std::size_t bytes = 0;      // of these
        int error = 0;              // errno of the next one; 0 when all were taken
        std::size_t refused = 0;    // datagrams that the error is about
    };
    /// Sends until the operating system takes no more. A refusal of segmentation itself is not
    /// told: from then on datagrams go one by one.
    Progress send(int socket, std::span<const Datagram> datagrams);

    [[nodiscard]] bool segments() const { return segments_; }

  private:
    static constexpr std::size_t kMessages = 64;
    struct alignas(cmsghdr) Control {
        std::array<unsigned char, CMSG_SPACE(sizeof(std::uint16_t))> bytes{};
    };
    void prepare(std::span<const Datagram> datagrams);
    void add_message(std::span<const Datagram> run, std::size_t piece);

    bool segments_;
    std::size_t messages_used_ = 0;
    std::array<::mmsghdr, kMessages> messages_{};
    std::array<std::size_t, kMessages> lengths_{};  // of each message, in datagrams
    std::array<Control, kMessages> controls_;
    std::vector<::iovec> pieces_;
};

/// How many of the first datagrams can go as one buffer: equal sizes, but the last may be smaller.
std::size_t run_length(std::span<const std::vector<std::uint8_t>> datagrams);

}  // namespace ellicast::sender
