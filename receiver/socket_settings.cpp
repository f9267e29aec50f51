#include "receiver/socket_settings.hpp"

#include <net/if.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace ellicast::receiver {
namespace {

template <class Value>
bool set(int socket, int level, int name, const Value& value) {
    return ::setsockopt(socket, level, name, &value, sizeof value) == 0;
}

int level_of(const ::sockaddr_storage& address) {
    return address.ss_family == AF_INET6 ? IPPROTO_IPV6 : IPPROTO_IP;
}

std::string reason() {
    return std::generic_category().message(errno);
}

}  // namespace

unsigned interface_index(const std::string& name) {
    if (name.empty()) return 0;
    const unsigned index = ::if_nametoindex(name.c_str());
    if (index == 0) throw ListenError("--interface: there is no '" + name + "'");
    return index;
}

void bind_to_interface(int socket, const std::string& name) {
    interface_index(name);
    if (::setsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, name.c_str(),
                     static_cast<::socklen_t>(name.size())) != 0) {
        throw ListenError("--interface " + name + ": " + reason());
    }
}

bool is_bound_to_interface(int socket) {
    int index = 0;
    ::socklen_t size = sizeof index;
    return ::getsockopt(socket, SOL_SOCKET, SO_BINDTOIFINDEX, &index, &size) == 0 && index != 0;
}

void share_port(int socket) {
    set(socket, SOL_SOCKET, SO_REUSEADDR, 1);
}

void join_group(int socket, const ::sockaddr_storage& group, unsigned interface_index,
                const ::sockaddr_storage* source) {
    const int level = level_of(group);
    // Only what this socket joined, not what others of this host did.
    if (level == IPPROTO_IP) set(socket, IPPROTO_IP, IP_MULTICAST_ALL, 0);
    if (level == IPPROTO_IPV6) set(socket, IPPROTO_IPV6, IPV6_MULTICAST_ALL, 0);
    bool joined = false;
    if (source != nullptr) {
        ::group_source_req request{};
        request.gsr_interface = interface_index;
        request.gsr_group = group;
        request.gsr_source = *source;
        joined = set(socket, level, MCAST_JOIN_SOURCE_GROUP, request);
    } else {
        ::group_req request{};
        request.gr_interface = interface_index;
        request.gr_group = group;
        joined = set(socket, level, MCAST_JOIN_GROUP, request);
    }
    if (joined) return;
    const bool choice = errno == ENODEV && interface_index == 0;
    throw ListenError("cannot join the group: " + reason() +
                      (choice ? "; name an interface with --interface" : ""));
}

void leave_group(int socket, const ::sockaddr_storage& group, unsigned interface_index) {
    ::group_req request{};
    request.gr_interface = interface_index;
    request.gr_group = group;
    set(socket, level_of(group), MCAST_LEAVE_GROUP, request);
}

void set_reception(int socket, int buffer_bytes) {
    if (!set(socket, SOL_SOCKET, SO_RCVBUFFORCE, buffer_bytes)) {
        set(socket, SOL_SOCKET, SO_RCVBUF, buffer_bytes);  // up to net.core.rmem_max
    }
    set(socket, SOL_SOCKET, SO_TIMESTAMPNS, 1);
}

}  // namespace ellicast::receiver
