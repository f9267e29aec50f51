// receiver/group_route.cpp: a question to the kernel (rtnetlink), as `ip route get GROUP` asks it.
#include "receiver/group_route.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <netinet/in.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ellicast::receiver {
namespace {

constexpr std::size_t kAnswer = 4096;

struct Question {
    ::nlmsghdr header{};
    ::rtmsg route{};
    ::rtattr destination{};
    std::array<std::uint8_t, 16> address{};
};
static_assert(offsetof(Question, address) ==
              NLMSG_LENGTH(sizeof(::rtmsg)) + RTA_LENGTH(0));  // no gaps between the parts

Question question_about(const ::sockaddr_storage& group) {
    Question question;
    std::size_t size = 4;
    if (group.ss_family == AF_INET6) {
        ::sockaddr_in6 v6{};
        std::memcpy(&v6, &group, sizeof v6);
        std::memcpy(question.address.data(), &v6.sin6_addr, size = 16);
    } else {
        ::sockaddr_in v4{};
        std::memcpy(&v4, &group, sizeof v4);
        std::memcpy(question.address.data(), &v4.sin_addr, size);
    }
    question.destination.rta_type = RTA_DST;
    question.destination.rta_len = static_cast<unsigned short>(RTA_LENGTH(size));
    question.route.rtm_family = static_cast<unsigned char>(group.ss_family);
    question.route.rtm_dst_len = static_cast<unsigned char>(8 * size);
    question.header.nlmsg_type = RTM_GETROUTE;
    question.header.nlmsg_flags = NLM_F_REQUEST;
    question.header.nlmsg_len = static_cast<std::uint32_t>(offsetof(Question, address) + size);
    return question;
}

/// The outgoing interface in the kernel's answer; 0 when that is an error, or has none.
unsigned interface_in(const std::uint8_t* answer, std::size_t size) {
    ::nlmsghdr header{};
    if (size < NLMSG_LENGTH(sizeof(::rtmsg))) return 0;
    std::memcpy(&header, answer, sizeof header);
    if (header.nlmsg_type != RTM_NEWROUTE || header.nlmsg_len > size) return 0;
    std::size_t at = NLMSG_LENGTH(sizeof(::rtmsg));
    ::rtattr attribute{};
    while (at + sizeof attribute <= header.nlmsg_len) {
        std::memcpy(&attribute, answer + at, sizeof attribute);
        if (attribute.rta_len < sizeof attribute || at + attribute.rta_len > header.nlmsg_len)
            break;
        if (attribute.rta_type == RTA_OIF && attribute.rta_len == RTA_LENGTH(sizeof(unsigned))) {
            unsigned index = 0;
            std::memcpy(&index, answer + at + RTA_LENGTH(0), sizeof index);
            return index;
        }
        at += RTA_ALIGN(attribute.rta_len);
    }
    return 0;
}

}  // namespace

unsigned interface_of_route(const ::sockaddr_storage& group) {
    const int socket = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (socket < 0) return 0;
    const Question question = question_about(group);
    std::array<std::uint8_t, kAnswer> answer{};
    unsigned index = 0;
    // The kernel answers before send() returns.
    if (::send(socket, &question, question.header.nlmsg_len, 0) > 0) {
        const ::ssize_t size = ::recv(socket, answer.data(), answer.size(), MSG_DONTWAIT);
        if (size > 0) index = interface_in(answer.data(), static_cast<std::size_t>(size));
    }
    ::close(socket);
    return index;
}

}  // namespace ellicast::receiver
