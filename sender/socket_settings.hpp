// sender/socket_settings.hpp: private to sender/udp_endpoint.
#pragma once

#include <optional>
#include <string>

#include "sender/udp_endpoint.hpp"

namespace ellicast::sender {

/// Index of the interface that the options name; 0 when they name none. Throws SendError when there
/// is no such interface.
unsigned interface_index(const SocketOptions& options);

/// What is to be settled of a UDP socket before it is connected, for a destination of that kind.
/// Throws SendError, naming the option, when the system refuses what was asked for; what nobody
/// asked for may be refused.
void set_addressing(int socket, bool v6, bool multicast, const SocketOptions& options);

/// Sends are to fail when the interface's queue is full; else such datagrams are lost without a
/// word. Then every ICMP answer fails a send, too.
void hear_of_full_queues(int socket, bool v6);

/// Empties what the kernel keeps of ICMP answers: as long as it keeps any, the socket counts as
/// ready for whatever is waited for.
void forget_answers(int socket);

/// Whether an interface of that name has an address of this family.
bool has_address(const std::string& interface, bool v6);

/// The interface of that name, or else the one that has the connected socket's own address, when
/// the system says how fast its link is (/sys/class/net). Tunnels say something, but not that.
std::optional<Link> link_of(int socket, const std::string& interface);

/// Packets are not to be fragmented, here or on the way.
void forbid_fragments(int socket, bool v6);

}  // namespace ellicast::sender
