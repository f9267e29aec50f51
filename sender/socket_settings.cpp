#include "sender/socket_settings.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <system_error>

namespace ellicast::sender {
namespace {

template <class Value>
bool set(int socket, int level, int name, const Value& value) {
    return ::setsockopt(socket, level, name, &value, sizeof value) == 0;
}

void require(bool done, const std::string& option) {
    if (!done) throw SendError(option + ": " + std::generic_category().message(errno));
}

void set_hops(int socket, bool v6, bool multicast, int hops) {
    const std::string option = "--ttl " + std::to_string(hops);
    if (v6) {
        const int name = multicast ? IPV6_MULTICAST_HOPS : IPV6_UNICAST_HOPS;
        require(set(socket, IPPROTO_IPV6, name, hops), option);
    } else {
        const int name = multicast ? IP_MULTICAST_TTL : IP_TTL;
        require(set(socket, IPPROTO_IP, name, hops), option);
    }
}

void set_interface(int socket, bool v6, bool multicast, const SocketOptions& options) {
    const std::string option = "--interface " + options.interface;
    const auto index = static_cast<int>(interface_index(options));
    if (!multicast) {
        require(::setsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, options.interface.c_str(),
                             static_cast<::socklen_t>(options.interface.size())) == 0,
                option);
    } else if (v6) {
        require(set(socket, IPPROTO_IPV6, IPV6_MULTICAST_IF, index), option);
    } else {
        ::ip_mreqn request{};
        request.imr_ifindex = index;
        require(set(socket, IPPROTO_IP, IP_MULTICAST_IF, request), option);
    }
}

bool same_address(const ::sockaddr& a, const ::sockaddr_storage& b) {
    if (a.sa_family != b.ss_family) return false;
    // sockaddr_in and sockaddr_in6 begin alike for both; copied, since neither may alias.
    if (a.sa_family == AF_INET) {
        ::sockaddr_in left{};
        ::sockaddr_in right{};
        std::memcpy(&left, &a, sizeof left);
        std::memcpy(&right, &b, sizeof right);
        return left.sin_addr.s_addr == right.sin_addr.s_addr;
    }
    if (a.sa_family != AF_INET6) return false;
    ::sockaddr_in6 left{};
    ::sockaddr_in6 right{};
    std::memcpy(&left, &a, sizeof left);
    std::memcpy(&right, &b, sizeof right);
    return std::memcmp(&left.sin6_addr, &right.sin6_addr, sizeof left.sin6_addr) == 0;
}

using Addresses = std::unique_ptr<::ifaddrs, decltype(&::freeifaddrs)>;

/// Of all interfaces; none where the kernel does not tell.
Addresses own_addresses() {
    ::ifaddrs* first = nullptr;
    if (::getifaddrs(&first) != 0) first = nullptr;
    return {first, ::freeifaddrs};
}

/// Name of the interface that has the socket's own address; "" where none is found, and where the
/// peer has the same one: that goes by the loopback interface, whatever has the address.
std::string interface_of(int socket) {
    ::sockaddr_storage local{};
    ::sockaddr_storage peer{};
    ::socklen_t length = sizeof local;
    if (::getsockname(socket, reinterpret_cast<::sockaddr*>(&local), &length) != 0) return "";
    length = sizeof peer;
    if (::getpeername(socket, reinterpret_cast<::sockaddr*>(&peer), &length) != 0) return "";
    if (same_address(reinterpret_cast<const ::sockaddr&>(peer), local)) return "";
    const Addresses all = own_addresses();
    for (const ::ifaddrs* entry = all.get(); entry; entry = entry->ifa_next) {
        if (entry->ifa_addr && same_address(*entry->ifa_addr, local)) return entry->ifa_name;
    }
    return "";
}

}  // namespace

std::optional<Link> link_of(int socket, const std::string& interface) {
    const std::string name = interface.empty() ? interface_of(socket) : interface;
    if (name.empty()) return std::nullopt;
    const std::filesystem::path about = std::filesystem::path("/sys/class/net") / name;
    std::error_code error;
    if (std::filesystem::exists(about / "tun_flags", error)) return std::nullopt;
    std::int64_t megabits = 0;
    std::ifstream(about / "speed") >> megabits;  // -1, or an error to read: not known
    if (megabits <= 0) return std::nullopt;
    return Link{name, static_cast<std::uint64_t>(megabits) * 1'000'000};
}

bool has_address(const std::string& interface, bool v6) {
    const Addresses all = own_addresses();
    for (const ::ifaddrs* entry = all.get(); entry; entry = entry->ifa_next) {
        if (entry->ifa_addr && entry->ifa_name == interface &&
            entry->ifa_addr->sa_family == (v6 ? AF_INET6 : AF_INET)) {
            return true;
        }
    }
    return false;
}

unsigned interface_index(const SocketOptions& options) {
    if (options.interface.empty()) return 0;
    const unsigned index = ::if_nametoindex(options.interface.c_str());
    if (index == 0) throw SendError("--interface: there is no '" + options.interface + "'");
    return index;
}

void set_addressing(int socket, bool v6, bool multicast, const SocketOptions& options) {
    if (!options.interface.empty()) set_interface(socket, v6, multicast, options);
    if (options.ttl) {
        set_hops(socket, v6, multicast, *options.ttl);
    } else if (multicast) {
        set_hops(socket, v6, true, 1);  // RFC 1112: no farther than this network unless asked for
    }
    if (options.dscp) {
        const int traffic_class = *options.dscp << 2;
        require(v6 ? set(socket, IPPROTO_IPV6, IPV6_TCLASS, traffic_class)
                   : set(socket, IPPROTO_IP, IP_TOS, traffic_class),
                "--dscp");
    }
    if (options.loopback) {
        if (!multicast) throw SendError("--loopback is about multicast groups");
        const int on = *options.loopback ? 1 : 0;
        require(v6 ? set(socket, IPPROTO_IPV6, IPV6_MULTICAST_LOOP, on)
                   : set(socket, IPPROTO_IP, IP_MULTICAST_LOOP, on),
                "--loopback");
    }
    if (options.broadcast) require(set(socket, SOL_SOCKET, SO_BROADCAST, 1), "--broadcast");
}

void forbid_fragments(int socket, bool v6) {
    set(socket, IPPROTO_IP, IP_MTU_DISCOVER, IP_PMTUDISC_DO);
    if (!v6) return;
    set(socket, IPPROTO_IPV6, IPV6_MTU_DISCOVER, IPV6_PMTUDISC_DO);
    set(socket, IPPROTO_IPV6, IPV6_DONTFRAG, 1);
}

void hear_of_full_queues(int socket, bool v6) {
    set(socket, IPPROTO_IP, IP_RECVERR, 1);
    if (v6) set(socket, IPPROTO_IPV6, IPV6_RECVERR, 1);
}

void forget_answers(int socket) {
    ::msghdr message{};
    while (::recvmsg(socket, &message, MSG_ERRQUEUE | MSG_DONTWAIT) >= 0) message = {};
}

}  // namespace ellicast::sender
