// tests/receiver/receive_thread_test.cpp: over the loopback interface.
#include "receiver/receive_thread.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/udp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstring>
#include <functional>
#include <thread>
#include <vector>

namespace ellicast::receiver {
namespace {

using namespace std::chrono_literals;

/// Two sockets, one connected to the other.
class Pair {
  public:
    Pair() : to_(::socket(AF_INET, SOCK_DGRAM, 0)), from_(::socket(AF_INET, SOCK_DGRAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t length = sizeof address;
        auto* const name = reinterpret_cast<sockaddr*>(&address);
        const int on = 1;
        ::setsockopt(to_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
        REQUIRE(::bind(to_, name, length) == 0);
        REQUIRE(::getsockname(to_, name, &length) == 0);
        REQUIRE(::connect(from_, name, length) == 0);
    }
    ~Pair() {
        ::close(to_);
        ::close(from_);
    }
    Pair(const Pair&) = delete;
    Pair& operator=(const Pair&) = delete;

    [[nodiscard]] int receiving() const { return to_; }
    /// Has the kernel hand over what it got in one piece; false where it cannot.
    [[nodiscard]] bool take_pieces() const {
        const int on = 1;
        return ::setsockopt(to_, IPPROTO_UDP, UDP_GRO, &on, sizeof on) == 0;
    }
    [[nodiscard]] bool takes_pieces() const {
        int on = 0;
        socklen_t length = sizeof on;
        return ::getsockopt(to_, IPPROTO_UDP, UDP_GRO, &on, &length) == 0 && on != 0;
    }
    /// As one buffer, of which the kernel makes datagrams of so many bytes. False where it cannot.
    [[nodiscard]] bool send_run(const std::vector<std::uint8_t>& bytes, int each) const {
        const int none = 0;
        const bool sent =
            ::setsockopt(from_, IPPROTO_UDP, UDP_SEGMENT, &each, sizeof each) == 0 &&
            ::send(from_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
        (void)::setsockopt(from_, IPPROTO_UDP, UDP_SEGMENT, &none, sizeof none);
        return sent;
    }
    void send(std::uint32_t number, std::size_t bytes = 100) const {
        std::vector<std::uint8_t> datagram(bytes);
        std::memcpy(datagram.data(), &number, sizeof number);
        // Off the test's thread, where no assertion may stand; what is missing shows at the end.
        (void)::send(from_, datagram.data(), datagram.size(), 0);
    }

  private:
    int to_;
    int from_;
};

std::uint32_t number_of(const Arrival& arrival) {
    std::uint32_t number = 0;
    std::memcpy(&number, arrival.bytes.data(), sizeof number);
    return number;
}

Time now() {
    return std::chrono::steady_clock::now().time_since_epoch();
}

/// False when it took too long.
bool await(const std::function<bool()>& done) {
    const Time until = now() + 20s;
    while (!done()) {
        if (now() > until) return false;
        std::this_thread::sleep_for(1ms);
    }
    return true;
}

}  // namespace

TEST_CASE("whoever takes when told, and until it is settled, gets everything, in order and once") {
    const Pair sockets;
    std::atomic<int> news{0};
    ReceiveThread thread(sockets.receiving(), [&] { ++news; });
    constexpr std::uint32_t kDatagrams = 3000;
    std::atomic<std::uint32_t> taken{0};
    std::atomic<bool> given_up{false};
    std::thread sending([&] {
        for (std::uint32_t k = 0; k < kDatagrams; ++k) {
            // No more on the way than the socket's buffer holds.
            while (k >= taken + 100 && !given_up) std::this_thread::sleep_for(1ms);
            sockets.send(k);
        }
    });
    std::uint32_t next = 0;
    bool in_order = true;
    int heeded = 0;
    const bool all = await([&] {
        if (news == heeded) return false;
        heeded = news;
        do {
            thread.take(10, [&](const Arrival& arrival) {
                in_order = in_order && number_of(arrival) == next++;
                return true;
            });
        } while (thread.unsettled());
        taken = next;
        return next == kDatagrams;
    });
    given_up = true;
    sending.join();
    CHECK(all);
    CHECK(in_order);
    CHECK(thread.caught_up());
}

TEST_CASE("it has caught up when nothing is in the socket, in hand, or waiting to be taken") {
    const Pair sockets;
    ReceiveThread thread(sockets.receiving(), [] {});
    CHECK(thread.caught_up());
    sockets.send(1);
    CHECK_FALSE(thread.caught_up());  // wherever it is by now
    std::size_t taken = 0;
    CHECK(await([&] {
        thread.take(1, [&](const Arrival&) { return ++taken > 0; });
        return taken == 1;
    }));
    CHECK(await([&] { return thread.caught_up(); }));
}

TEST_CASE("a datagram bears the time at which it came, however late it is taken") {
    const Pair sockets;
    const Time before = now();
    sockets.send(1, 1200);
    const Time after = now();
    std::this_thread::sleep_for(50ms);
    ReceiveThread thread(sockets.receiving(), [] {});
    Time time{};
    std::size_t size = 0;
    const bool came = await([&] {
        thread.take(1, [&](const Arrival& arrival) {
            time = arrival.time;
            size = arrival.bytes.size();
            return true;
        });
        return size > 0;
    });
    CHECK(came);
    CHECK(size == 1200);
    CHECK(time >= before - 5ms);  // two clocks, read one after the other
    CHECK(time <= after + 5ms);
}

TEST_CASE("what comes in one piece is taken apart") {
    const Pair sockets;
    std::vector<std::uint8_t> run(1037);
    for (std::size_t k = 0; k < run.size(); ++k) run[k] = static_cast<std::uint8_t>(k / 100);
    if (!sockets.take_pieces() || !sockets.send_run(run, 100)) {
        WARN("SKIPPED: this kernel cannot segment datagrams");
        return;
    }
    sockets.send(77);
    sockets.send(78, 4);
    ReceiveThread thread(sockets.receiving(), [] {});
    std::vector<std::vector<std::uint8_t>> taken;
    CHECK(await([&] {
        thread.take(100, [&](const Arrival& arrival) {
            taken.emplace_back(arrival.bytes.begin(), arrival.bytes.end());
            return true;
        });
        return taken.size() == 13;
    }));
    REQUIRE(taken.size() == 13);
    for (std::uint8_t k = 0; k < 10; ++k) {
        CHECK(taken[k] == std::vector<std::uint8_t>(100, k));
    }
    CHECK(taken[10] == std::vector<std::uint8_t>(37, 10));
    CHECK(taken[11].size() == 100);
    CHECK(taken[12].size() == 4);
    CHECK(thread.taken().datagrams == 13);
    CHECK(thread.taken().pieces == 3);
}

TEST_CASE("it asks for pieces when it falls behind, and not before") {
    constexpr std::uint32_t kMany = 1500;
    const Pair sockets;
    const int room = 8 << 20;
    if (::setsockopt(sockets.receiving(), SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room) != 0) {
        WARN("SKIPPED: no right to a large buffer");
        return;
    }
    if (!Pair().take_pieces()) {
        WARN("SKIPPED: this kernel knows no pieces");
        return;
    }
    std::uint32_t next = 0;
    bool in_order = true;
    const auto take_until = [&](ReceiveThread& thread, std::uint32_t count) {
        return await([&] {
            thread.take(1000, [&](const Arrival& arrival) {
                in_order = in_order && number_of(arrival) == next++;
                return true;
            });
            return next == count;
        });
    };
    {
        ReceiveThread thread(sockets.receiving(), [] {});
        for (std::uint32_t k = 0; k < kMany; ++k) {
            sockets.send(k);
            if (k % 20 == 19) REQUIRE(take_until(thread, k + 1));
        }
        CHECK_FALSE(sockets.takes_pieces());
    }
    for (std::uint32_t k = kMany; k < 2 * kMany; ++k) sockets.send(k);
    ReceiveThread thread(sockets.receiving(), [] {});
    CHECK(take_until(thread, 2 * kMany));
    CHECK(sockets.takes_pieces());
    CHECK(in_order);
}

TEST_CASE("it ends at once, with datagrams or without") {
    const Pair sockets;
    const Time begin = now();
    for (int k = 0; k < 20; ++k) {
        sockets.send(1);
        const ReceiveThread thread(sockets.receiving(), [] {});
    }
    CHECK(now() - begin < 20s);
}

}  // namespace ellicast::receiver
