// receiver/udp_endpoint.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "common/text_values.hpp"
#include "receiver/arrival.hpp"
#include "receiver/session.hpp"

namespace ellicast::receiver {

/// The address cannot be listened on; one line that names it and the reason.
class ListenError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Where to listen.
struct ListenOptions {
    common::Endpoint listen{};  // a multicast group is joined; an empty host is any address
    std::string interface {};   // by name; empty: all, and for a group the system's choice
    std::string source{};       // address: of a group, what it sends alone (RFC 4607); empty: all
};

/// A bound UDP socket, and the loop that feeds a session from it. The receiver's only contact with
/// the network and its clock. While it lives, SIGINT and SIGTERM end reception instead of the
/// program.
class UdpEndpoint {
  public:
    /// Binds; from then on nothing that arrives is missed. An empty host is any address, IPv4 and
    /// IPv6 at once. Throws ListenError.
    explicit UdpEndpoint(const ListenOptions& options);
    ~UdpEndpoint();
    UdpEndpoint(const UdpEndpoint&) = delete;
    UdpEndpoint& operator=(const UdpEndpoint&) = delete;

    /// Feeds the session until it is finished, by itself or by a signal. Calls on_tick(now) about
    /// ten times a second, and on_arrival(now), where given, after every few datagrams too.
    /// Datagrams bear the time at which the kernel took them.
    void run(Session& session, const std::function<void(Time)>& on_tick,
             const std::function<void(Time)>& on_arrival = {});

    /// As bound: "[::]:5004".
    [[nodiscard]] std::string address() const;
    /// What the kernel granted; bytes, its own overhead included.
    [[nodiscard]] std::size_t receive_buffer() const;
    /// Datagrams that found the socket's buffer full; up to date to a tenth of a second. Of those
    /// that came several in one piece, which only happens while we are too slow, the kernel counts
    /// pieces: then it is their number times the mean of the pieces that were taken.
    [[nodiscard]] std::uint64_t kernel_dropped() const;

    /// The clock of all sessions fed here.
    static Time now();

    /// Sends a datagram to a local socket, by path or '@' and a name; common::ServiceNotification's
    /// way out. Whoever does not listen is not told.
    static void tell_local(const std::string& socket, std::string_view lines);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace ellicast::receiver
