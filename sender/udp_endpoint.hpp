// sender/udp_endpoint.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "sender/session.hpp"

namespace ellicast::sender {

/// The address cannot be sent to, or not in datagrams of this size; one line that names it and the
/// reason.
class SendError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// What became of the datagrams that a session handed out. All of it is normal: nobody answers, and
/// nobody needs to listen.
struct EndpointCounts {
    std::uint64_t sent = 0;     // taken by the operating system
    std::uint64_t bytes = 0;    // of those, UDP payload
    std::uint64_t refused = 0;  // not taken: no route, no buffers, filtered, too long; lost
    std::uint64_t unreachable =
        0;  // ICMP answers that nobody listens there; the datagram went out all the same
    std::uint64_t socket_full = 0;  // waits for room in the socket's buffer; nothing is lost
    std::string last_refusal;       // the operating system's word for the last one refused
};

/// A connected UDP socket, and the loop that empties a session into it. The sender's only contact
/// with the network and its clock. Datagrams are never fragmented (DF).
class UdpEndpoint {
  public:
    /// Resolves the host (name, IPv4 or IPv6 address without brackets) and opens a socket to the
    /// first of its addresses that can be had. Throws SendError, also when the interface is known
    /// not to carry datagrams of that size.
    UdpEndpoint(const std::string& host, std::uint16_t port, std::size_t datagram_bytes);
    ~UdpEndpoint();
    UdpEndpoint(const UdpEndpoint&) = delete;
    UdpEndpoint& operator=(const UdpEndpoint&) = delete;

    /// Sends what the session hands out until it is done, or SIGINT or SIGTERM ends it: then false.
    /// While it runs these signals do not end the program. Calls on_tick about five times a second.
    bool run(Session& session, const std::function<void()>& on_tick);

    /// As resolved: "127.0.0.1:5004", "[::1]:5004".
    [[nodiscard]] std::string peer() const;
    /// Headers below the payload: 28 bytes on IPv4, 48 on IPv6.
    [[nodiscard]] std::size_t ip_udp_bytes() const;
    /// What the way to the peer is known to carry in one IP packet.
    [[nodiscard]] std::optional<std::size_t> mtu() const;
    [[nodiscard]] const EndpointCounts& counts() const;

    /// The clock of all sessions run here.
    static Time now();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace ellicast::sender
