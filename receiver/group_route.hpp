// receiver/group_route.hpp: private to receiver/udp_endpoint.
#pragma once

#include <sys/socket.h>

namespace ellicast::receiver {

/// Index of the interface that the routes of this host lead to for a group, as the kernel chooses
/// it when a group is joined by none in particular. 0 where there is no route, or no answer.
unsigned interface_of_route(const ::sockaddr_storage& group);

}  // namespace ellicast::receiver
