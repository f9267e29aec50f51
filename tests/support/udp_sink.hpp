// tests/support/udp_sink.hpp: a few lines of receiver, for tests of the sending end.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <vector>

namespace ellicast::tests {

/// Listens on a free port of the loopback interface and keeps every datagram.
class UdpSink {
  public:
    explicit UdpSink(bool v6 = false) : socket_(::socket(v6 ? AF_INET6 : AF_INET, SOCK_DGRAM, 0)) {
        const int buffer = 8 << 20;
        // With the rights for it, beyond the system's limit: a busy machine may not read for a
        // while.
        if (::setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer) != 0) {
            ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
        }
        sockaddr_in any4{};
        any4.sin_family = AF_INET;
        any4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        sockaddr_in6 any6{};
        any6.sin6_family = AF_INET6;
        any6.sin6_addr = in6addr_loopback;
        const auto* address = v6 ? reinterpret_cast<const sockaddr*>(&any6)
                                 : reinterpret_cast<const sockaddr*>(&any4);
        const socklen_t length = v6 ? sizeof any6 : sizeof any4;
        if (::bind(socket_, address, length) != 0) throw std::runtime_error("no loopback socket");
        sockaddr_in6 bound{};
        socklen_t bound_length = sizeof bound;
        ::getsockname(socket_, reinterpret_cast<sockaddr*>(&bound), &bound_length);
        port_ = ntohs(bound.sin6_port);  // at the same place in both families
        reader_ = std::thread([this] { read(); });
    }
    ~UdpSink() {
        stop();
        ::close(socket_);
    }
    UdpSink(const UdpSink&) = delete;
    UdpSink& operator=(const UdpSink&) = delete;

    [[nodiscard]] std::uint16_t port() const { return port_; }

    /// Waits until `count` datagrams came; false when 20 s passed without them.
    [[nodiscard]] bool await(std::size_t count) const {
        const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
        while (count_ < count) {
            if (std::chrono::steady_clock::now() > give_up) return false;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        return true;
    }

    /// What came until now; waits for silence of 200 ms first. Nothing is kept from then on.
    const std::vector<std::vector<std::uint8_t>>& datagrams() {
        stop();
        return datagrams_;
    }

  private:
    void read() {
        std::vector<std::uint8_t> buffer(1 << 16);
        for (;;) {
            pollfd ready{socket_, POLLIN, 0};
            if (::poll(&ready, 1, 200) == 0) {
                if (stopping_) return;
                continue;
            }
            const ssize_t size = ::recv(socket_, buffer.data(), buffer.size(), 0);
            if (size < 0) continue;
            datagrams_.emplace_back(buffer.begin(), buffer.begin() + size);
            ++count_;
        }
    }
    void stop() {
        stopping_ = true;
        if (reader_.joinable()) reader_.join();
    }

    int socket_;
    std::uint16_t port_ = 0;
    std::atomic<bool> stopping_{false};
    std::atomic<std::size_t> count_{0};
    std::vector<std::vector<std::uint8_t>> datagrams_;
    std::thread reader_;
};

}  // namespace ellicast::tests
