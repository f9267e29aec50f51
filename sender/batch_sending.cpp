#include "sender/batch_sending.hpp"

#include <netinet/in.h>
#include <netinet/udp.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace ellicast::sender {
namespace {

constexpr std::size_t kMostInRun = 64;           // UDP_MAX_SEGMENTS of Linux before 6.9
constexpr std::size_t kMostBytesInRun = 65'000;  // one IP packet until it is cut, with its headers
constexpr std::size_t kMostPieces = 512;         // datagrams of one system call

/// What the kernel says when it, the route or the interface cannot cut buffers up.
bool is_about_segments(int error) {
    return error == EINVAL || error == EIO || error == EOPNOTSUPP || error == ENOPROTOOPT ||
           error == EMSGSIZE;
}

}  // namespace

std::size_t run_length(std::span<const std::vector<std::uint8_t>> datagrams) {
    const std::size_t size = datagrams.front().size();
    if (size == 0) return 1;
    const std::size_t most =
        std::min({datagrams.size(), kMostInRun, std::max<std::size_t>(1, kMostBytesInRun / size)});
    std::size_t length = 1;
    while (length < most && datagrams[length].size() == size) ++length;
    if (length < most && datagrams[length].size() < size && !datagrams[length].empty()) ++length;
    return length;
}

void BatchSending::add_message(std::span<const Datagram> run, std::size_t piece) {
    for (const Datagram& datagram : run) {
        // The kernel only reads; the interface knows no const.
        pieces_.push_back({const_cast<std::uint8_t*>(datagram.data()), datagram.size()});
    }
    lengths_[messages_used_] = run.size();
    Control& control = controls_[messages_used_];
    ::msghdr& header = messages_[messages_used_++].msg_hdr;
    header = {};
    header.msg_iov = pieces_.data() + piece;
    header.msg_iovlen = run.size();
    if (run.size() == 1) return;
    header.msg_control = control.bytes.data();
    header.msg_controllen = control.bytes.size();
    ::cmsghdr* const segment = CMSG_FIRSTHDR(&header);
    segment->cmsg_level = IPPROTO_UDP;
    segment->cmsg_type = UDP_SEGMENT;
    segment->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
    const auto size = static_cast<std::uint16_t>(run.front().size());
    std::memcpy(CMSG_DATA(segment), &size, sizeof size);
}

void BatchSending::prepare(std::span<const Datagram> datagrams) {
    pieces_.clear();
    pieces_.reserve(kMostPieces);  // never moves below
    messages_used_ = 0;
    std::size_t at = 0;
    while (at < datagrams.size() && messages_used_ < kMessages) {
        const std::size_t length = segments_ ? run_length(datagrams.subspan(at)) : 1;
        if (at + length > kMostPieces) break;
        add_message(datagrams.subspan(at, length), at);
        at += length;
    }
}

BatchSending::Progress BatchSending::send(int socket, std::span<const Datagram> datagrams) {
    Progress progress;
    while (progress.datagrams < datagrams.size()) {
        const auto rest = datagrams.subspan(progress.datagrams);
        prepare(rest);
        const int taken = ::sendmmsg(socket, messages_.data(),
                                     static_cast<unsigned>(messages_used_), MSG_NOSIGNAL);
        if (taken <= 0) {
            const int error = taken == 0 ? EAGAIN : errno;
            if (lengths_[0] > 1 && is_about_segments(error)) {
                segments_ = false;
                continue;
            }
            progress.error = error;
            progress.refused = lengths_[0];
            return progress;
        }
        std::size_t count = 0;
        for (std::size_t k = 0; k < static_cast<std::size_t>(taken); ++k) count += lengths_[k];
        for (const Datagram& datagram : rest.first(count)) progress.bytes += datagram.size();
        progress.datagrams += count;
    }
    return progress;
}

}  // namespace ellicast::sender
