// tests/sender/service_notification_test.cpp: with real sockets, by the endpoint.
#include "common/service_notification.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstddef>
#include <cstdlib>
#include <string>

#include "sender/udp_endpoint.hpp"

using ellicast::common::status_line;
using ellicast::sender::UdpEndpoint;
using namespace std::chrono_literals;

namespace {

struct Notification : ellicast::common::ServiceNotification {
    Notification() : ServiceNotification(UdpEndpoint::tell_local) {}
};

/// The manager's end: a datagram socket under an abstract name, or under a path.
class Manager {
  public:
    explicit Manager(const std::string& name) : socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        name.copy(address.sun_path, name.size());
        if (name[0] == '@') address.sun_path[0] = '\0';
        const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
        REQUIRE(::bind(socket_, reinterpret_cast<sockaddr*>(&address), length) == 0);
        setenv("NOTIFY_SOCKET", name.c_str(), 1);
    }
    ~Manager() { ::close(socket_); }
    Manager(const Manager&) = delete;
    Manager& operator=(const Manager&) = delete;

    /// "" when nothing came.
    [[nodiscard]] std::string next() const {
        std::array<char, 512> bytes{};
        const ssize_t size = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
        return {bytes.data(), static_cast<std::size_t>(size < 0 ? 0 : size)};
    }

  private:
    int socket_;
};

std::string name_of_my_own() {
    return "@ellicast-test-" + std::to_string(::getpid());
}

}  // namespace

TEST_CASE("the manager hears what was said, in order, and children find no socket to speak to") {
    const Manager manager(name_of_my_own());
    setenv("WATCHDOG_USEC", "3000000", 1);
    const Notification notification;
    CHECK(notification.wanted());
    CHECK(notification.watchdog_interval() == 1500ms);
    CHECK(std::getenv("NOTIFY_SOCKET") == nullptr);
    CHECK(std::getenv("WATCHDOG_USEC") == nullptr);
    notification.ready("sending\n3 pages");
    notification.alive();
    notification.stopping();
    CHECK(manager.next() == "READY=1\nSTATUS=sending 3 pages");
    CHECK(manager.next() == "WATCHDOG=1");
    CHECK(manager.next() == "STOPPING=1");
    CHECK(manager.next().empty());
}

TEST_CASE("a watchdog hears from us twice in an interval, whoever has none never") {
    const Manager manager(name_of_my_own());
    setenv("WATCHDOG_USEC", "4000000", 1);  // so that 2 s is the interval
    Notification watched;
    const auto heard = [&](std::chrono::nanoseconds now) {
        watched.alive_when_due(now);
        return manager.next() == "WATCHDOG=1";
    };
    CHECK(heard(10s));
    CHECK_FALSE(heard(10'999ms));
    CHECK(heard(11s));
    CHECK_FALSE(heard(11'500ms));
    CHECK(heard(20s));
    setenv("NOTIFY_SOCKET", name_of_my_own().c_str(), 1);
    Notification unwatched;
    unwatched.alive_when_due(10s);
    CHECK(manager.next().empty());
}

TEST_CASE("a socket with a path is found too") {
    const std::string path = "/tmp/ellicast-test-" + std::to_string(::getpid());
    {
        const Manager manager(path);
        Notification().status("here");
        CHECK(manager.next() == "STATUS=here");
    }
    ::unlink(path.c_str());
}

TEST_CASE("without a manager, or with nonsense for one, nothing happens") {
    unsetenv("NOTIFY_SOCKET");
    CHECK_FALSE(Notification().wanted());
    for (const char* nonsense : {"", "relative", "@nobody-listens-here"}) {
        setenv("NOTIFY_SOCKET", nonsense, 1);
        setenv("WATCHDOG_USEC", "twelve", 1);
        const Notification notification;
        notification.ready("to nobody");
        CHECK_FALSE(notification.watchdog_interval());
    }
    setenv("NOTIFY_SOCKET", ("/" + std::string(200, 'x')).c_str(), 1);
    CHECK_FALSE(Notification().wanted());
}

TEST_CASE("a status is one line") {
    CHECK(status_line("a\nREADY=1\tb") == "a READY=1 b");
}
