// sender/udp_endpoint.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

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
    std::uint64_t refused = 0;  // not taken: no route, filtered, too long; lost
    std::uint64_t unreachable =
        0;  // ICMP answers that nobody listens there; the datagram went out all the same
    std::uint64_t socket_full = 0;  // waits for room in the socket's buffer or in the interface's
                                    // queue; nothing is lost
    std::string last_refusal;       // the operating system's word for the last one refused
};

/// How datagrams go out.
struct SocketOptions {
    /// Hand runs of datagrams over as one buffer, where the kernel can (see BatchSending): for fast
    /// streams, which would leave in bursts anyway.
    bool segments = false;
    std::string interface {};        // by name; empty: as the routes say
    std::optional<int> ttl{};        // hops; empty: the system's, 1 to multicast groups
    std::optional<int> dscp{};       // 0 to 63, RFC 2474
    std::optional<bool> loopback{};  // of multicast, to listeners on this host; empty: the system's
    bool broadcast = false;          // the destination may be a broadcast address
};

/// An interface and the speed of its link.
struct Link {
    std::string interface;
    std::uint64_t bits_per_second = 0;
};

/// What the loop has others do, and how it ends on demand.
struct RunHooks {
    std::function<bool()> on_tick;    // about five times a second, also while the socket is full;
                                      // false ends it at once
    std::function<void()> on_hangup;  // SIGHUP; without it the signal does what it does
    Time stop_within = Time::zero();  // what SIGTERM leaves the round to end; zero: nothing
};

/// A connected UDP socket, and the loop that empties a session into it. The sender's only contact
/// with the network and its clock. Datagrams are never fragmented (DF).
class UdpEndpoint {
  public:
    /// Resolves the host (name, IPv4 or IPv6 address without brackets, perhaps a multicast group)
    /// and opens a socket to the first of its addresses that can be had. Throws SendError, also
    /// when the interface is known not to carry datagrams of that size.
    UdpEndpoint(const std::string& host, std::uint16_t port, std::size_t datagram_bytes,
                const SocketOptions& options = {});
    ~UdpEndpoint();
    UdpEndpoint(const UdpEndpoint&) = delete;
    UdpEndpoint& operator=(const UdpEndpoint&) = delete;

    /// Sends what the session hands out until it is done. SIGTERM lets the round end, for as long
    /// as the hooks allow; SIGINT, or another SIGTERM, ends it at once. While it runs these signals
    /// do not end the program. False when one of them, or the tick, left out something.
    bool run(Session& session, const RunHooks& hooks = {});

    /// As resolved: "127.0.0.1:5004", "[::1]:5004".
    [[nodiscard]] std::string peer() const;
    /// Where it sends to and from, without port, brackets and zone; "" where the system does not
    /// say.
    [[nodiscard]] std::string peer_address() const;
    [[nodiscard]] std::string local_address() const;
    /// The interface by which it sends, as far as the system tells how fast that is.
    [[nodiscard]] std::optional<Link> link() const;
    /// Headers below the payload: 28 bytes on IPv4, 48 on IPv6.
    [[nodiscard]] std::size_t ip_udp_bytes() const;
    /// What the way to the peer is known to carry in one IP packet.
    [[nodiscard]] std::optional<std::size_t> mtu() const;
    [[nodiscard]] const EndpointCounts& counts() const;

    /// The clock of all sessions run here.
    static Time now();

    /// Sends a datagram to a local socket, by path or '@' and a name; common::ServiceNotification's
    /// way out. Whoever does not listen is not told.
    static void tell_local(const std::string& socket, std::string_view lines);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace ellicast::sender
