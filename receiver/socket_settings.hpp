// receiver/socket_settings.hpp: private to receiver/udp_endpoint.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include "receiver/udp_endpoint.hpp"

namespace ellicast::receiver {

/// Index of the interface of that name; 0 for none. Throws ListenError when there is none such.
unsigned interface_index(const std::string& name);

/// Hears that interface alone. Throws ListenError.
void bind_to_interface(int socket, const std::string& name);

/// Whether the socket hears one interface alone.
bool is_bound_to_interface(int socket);

/// Lets other programs of this host listen to the same group and port.
void share_port(int socket);

/// Joins a group, by one interface (0: the system's choice), for what that source sends or for all.
/// Throws ListenError.
void join_group(int socket, const ::sockaddr_storage& group, unsigned interface_index,
                const ::sockaddr_storage* source);

/// Gives up what join_group() did, whether the interface is still there or not.
void leave_group(int socket, const ::sockaddr_storage& group, unsigned interface_index);

/// Timestamps, and a large buffer. Each is an improvement that reception can do without, so
/// failures are let pass.
void set_reception(int socket, int buffer_bytes);

}  // namespace ellicast::receiver
