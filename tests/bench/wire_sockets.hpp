// tests/bench/wire_sockets.hpp: plain sockets, for benchmarks to stand beside.
#pragma once

#include <arpa/inet.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <netinet/udp.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace ellicast::bench {

constexpr std::size_t kBatch = 64;  // datagrams a system call
constexpr std::size_t kBytes = 1200;

/// Processor time, the system's share included.
inline double cpu_seconds(clockid_t clock) {
    ::timespec t{};
    ::clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
inline double thread_cpu_seconds() {
    return cpu_seconds(CLOCK_THREAD_CPUTIME_ID);
}
inline double process_cpu_seconds() {
    return cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
}

inline int loopback_socket() {
    const int number = ::socket(AF_INET, SOCK_DGRAM, 0);
    if (number < 0) throw std::system_error(errno, std::generic_category(), "socket");
    return number;
}

inline ::sockaddr_in loopback(std::uint16_t port) {
    ::sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
}

/// A bound socket that counts.
class Sink {
  public:
    explicit Sink(int buffer_bytes) : socket_(loopback_socket()) {
        if (::setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &buffer_bytes, sizeof buffer_bytes)) {
            ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
        }
        ::sockaddr_in any = loopback(0);
        ::socklen_t length = sizeof any;
        if (::bind(socket_, reinterpret_cast<const ::sockaddr*>(&any), length) != 0 ||
            ::getsockname(socket_, reinterpret_cast<::sockaddr*>(&any), &length) != 0) {
            throw std::system_error(errno, std::generic_category(), "bind");
        }
        port_ = ntohs(any.sin_port);
    }
    ~Sink() { ::close(socket_); }
    Sink(const Sink&) = delete;
    Sink& operator=(const Sink&) = delete;

    [[nodiscard]] std::uint16_t port() const { return port_; }

    /// A loop that receives and does nothing else, until nothing came for `silence`.
    std::uint64_t receive_until_silence(std::chrono::milliseconds silence) {
        std::vector<std::uint8_t> bytes(kBatch * (kBytes + 64));
        std::array<::iovec, kBatch> pieces{};
        std::array<::mmsghdr, kBatch> messages{};
        for (std::size_t k = 0; k < kBatch; ++k) {
            pieces[k] = {bytes.data() + k * (kBytes + 64), kBytes + 64};
            messages[k].msg_hdr.msg_iov = &pieces[k];
            messages[k].msg_hdr.msg_iovlen = 1;
        }
        std::uint64_t received = 0;
        for (;;) {
            const int count = ::recvmmsg(socket_, messages.data(), kBatch, MSG_DONTWAIT, nullptr);
            if (count > 0) {
                received += static_cast<std::uint64_t>(count);
                continue;
            }
            ::pollfd ready{socket_, POLLIN, 0};
            if (::poll(&ready, 1, static_cast<int>(silence.count())) == 0) return received;
        }
    }

    /// For want of room.
    [[nodiscard]] std::uint64_t dropped() const {
        std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
        ::socklen_t size = sizeof info;
        ::getsockopt(socket_, SOL_SOCKET, SO_MEMINFO, info.data(), &size);
        return info[SK_MEMINFO_DROPS];
    }
    /// Dropped, or waiting still; takes out what waits.
    std::uint64_t arrived() {
        return receive_until_silence(std::chrono::milliseconds(0)) + dropped();
    }

  private:
    int socket_;
    std::uint16_t port_ = 0;
};

/// A loop that sends and does nothing else.
class Load {
  public:
    explicit Load(std::uint16_t port) : socket_(loopback_socket()), bytes_(kBatch * kBytes) {
        const ::sockaddr_in to = loopback(port);
        if (::connect(socket_, reinterpret_cast<const ::sockaddr*>(&to), sizeof to) != 0) {
            throw std::system_error(errno, std::generic_category(), "connect");
        }
    }
    ~Load() { ::close(socket_); }
    Load(const Load&) = delete;
    Load& operator=(const Load&) = delete;

    /// The next `count` datagrams of 1200 bytes, at most kBatch: one sendmmsg.
    std::size_t send_plain(std::size_t count) {
        for (std::size_t k = 0; k < count; ++k) {
            pieces_[k] = {bytes_.data() + k * kBytes, kBytes};
            messages_[k].msg_hdr.msg_iov = &pieces_[k];
            messages_[k].msg_hdr.msg_iovlen = 1;
        }
        std::size_t done = 0;
        while (done < count) {
            const int taken = ::sendmmsg(socket_, messages_.data() + done,
                                         static_cast<unsigned>(count - done), 0);
            if (taken < 0) throw std::system_error(errno, std::generic_category(), "sendmmsg");
            done += static_cast<std::size_t>(taken);
        }
        sent_ += count;
        return count;
    }
    [[nodiscard]] int number() const { return socket_; }
    [[nodiscard]] std::uint64_t sent() const { return sent_; }

  private:
    int socket_;
    std::vector<std::uint8_t> bytes_;
    std::array<::iovec, kBatch> pieces_{};
    std::array<::mmsghdr, kBatch> messages_{};
    std::uint64_t sent_ = 0;
};

}  // namespace ellicast::bench
