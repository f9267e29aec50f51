// tests/sender/socket_settings_test.cpp: over the loopback interface.
#include "sender/socket_settings.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdint>

#include "tests/support/child_process.hpp"

namespace ellicast::sender {
namespace {

/// A UDP socket connected to a port of the loopback interface.
class Connected {
  public:
    explicit Connected(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
        hear_of_full_queues(socket_, false);
        ::sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(port);
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        REQUIRE(::connect(socket_, reinterpret_cast<::sockaddr*>(&to), sizeof to) == 0);
    }
    ~Connected() { ::close(socket_); }
    Connected(const Connected&) = delete;
    Connected& operator=(const Connected&) = delete;

    [[nodiscard]] int native() const { return socket_; }
    /// Whether whoever waits for the socket is woken by an error.
    [[nodiscard]] bool is_woken(int milliseconds) const {
        ::pollfd waiting{socket_, 0, 0};
        return ::poll(&waiting, 1, milliseconds) == 1 && (waiting.revents & POLLERR) != 0;
    }

  private:
    int socket_;
};

}  // namespace

TEST_CASE("answers that were read wake nobody any more") {
    const Connected socket(tests::free_port());
    for (int k = 0; k < 3; ++k) {
        // From the second time on it may tell the first answer instead.
        (void)::send(socket.native(), "x", 1, 0);
        REQUIRE(socket.is_woken(5000));
    }
    // Being told does not empty the queue.
    (void)::send(socket.native(), "x", 1, 0);
    REQUIRE(socket.is_woken(5000));
    forget_answers(socket.native());
    CHECK_FALSE(socket.is_woken(0));
    forget_answers(socket.native());  // nothing there
    CHECK_FALSE(socket.is_woken(0));
}

TEST_CASE("the link of a stream to one's own address is not asked for") {
    const Connected socket(tests::free_port());
    CHECK_FALSE(link_of(socket.native(), "").has_value());
}

TEST_CASE("interfaces are asked for addresses of a family") {
    CHECK(has_address("lo", false));
    CHECK_FALSE(has_address("nowhere", false));
    CHECK_FALSE(has_address("nowhere", true));
}

}  // namespace ellicast::sender
