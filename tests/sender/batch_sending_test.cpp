#include "sender/batch_sending.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "tests/support/udp_sink.hpp"

namespace ellicast::sender {
namespace {

using Datagram = BatchSending::Datagram;

std::vector<Datagram> of_sizes(const std::vector<std::size_t>& sizes) {
    std::vector<Datagram> datagrams;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
        datagrams.emplace_back(sizes[k], static_cast<std::uint8_t>(k));
    }
    return datagrams;
}

std::size_t run_of(const std::vector<std::size_t>& sizes) {
    return run_length(of_sizes(sizes));
}

/// A socket connected to the sink, closed with the object.
class Socket {
  public:
    explicit Socket(std::uint16_t port) : number_(::socket(AF_INET, SOCK_DGRAM, 0)) {
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        to.sin_port = htons(port);
        REQUIRE(::connect(number_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
    }
    ~Socket() { ::close(number_); }
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    [[nodiscard]] int number() const { return number_; }

  private:
    int number_;
};

}  // namespace

TEST_CASE("a run is of equal sizes, and only its last may be smaller") {
    CHECK(run_of({1200}) == 1);
    CHECK(run_of({1200, 1200, 1200}) == 3);
    CHECK(run_of({1200, 1200, 1100, 1100}) == 3);
    CHECK(run_of({1200, 1100, 1200}) == 2);
    CHECK(run_of({1100, 1200, 1200}) == 1);
    CHECK(run_of({1200, 1200, 0, 1200}) == 2);
    CHECK(run_of({0, 0}) == 1);
}

TEST_CASE("a run is no longer than the kernel takes at once") {
    CHECK(run_of(std::vector<std::size_t>(100, 600)) == 64);
    CHECK(run_of(std::vector<std::size_t>(100, 1200)) == 54);
    CHECK(run_of(std::vector<std::size_t>(100, 40'000)) == 1);
}

TEST_CASE("datagrams of any sizes arrive whole and in order, with segmentation or without") {
    const bool segments = GENERATE(false, true);
    tests::UdpSink sink;
    const Socket socket(sink.port());
    std::vector<std::size_t> sizes;
    for (std::size_t k = 0; k < 700; ++k) sizes.push_back(k % 9 == 8 ? 900 + k : 1200);
    const std::vector<Datagram> datagrams = of_sizes(sizes);
    BatchSending sending(segments);
    const BatchSending::Progress progress = sending.send(socket.number(), datagrams);
    CHECK(progress.error == 0);
    CHECK(progress.datagrams == datagrams.size());
    std::size_t bytes = 0;
    for (const std::size_t size : sizes) bytes += size;
    CHECK(progress.bytes == bytes);
    CHECK(sink.datagrams() == datagrams);
}

TEST_CASE("where the kernel refuses segmentation, datagrams go one by one and none is lost") {
    tests::UdpSink sink;
    const Socket socket(sink.port());
    const int on = 1;  // without checksums there is nobody to make those of the parts
    REQUIRE(::setsockopt(socket.number(), SOL_SOCKET, SO_NO_CHECK, &on, sizeof on) == 0);
    const std::vector<Datagram> datagrams = of_sizes(std::vector<std::size_t>(100, 1000));
    BatchSending sending(true);
    const BatchSending::Progress progress = sending.send(socket.number(), datagrams);
    CHECK(progress.error == 0);
    CHECK(progress.datagrams == datagrams.size());
    CHECK_FALSE(sending.segments());
    CHECK(sink.datagrams() == datagrams);
}

TEST_CASE("an error tells whom it is about") {
    tests::UdpSink sink;
    const Socket socket(sink.port());
    std::vector<Datagram> datagrams = of_sizes({1200, 1200, 70'000, 1200});
    BatchSending sending(true);
    const BatchSending::Progress progress = sending.send(socket.number(), datagrams);
    CHECK(progress.datagrams == 2);
    CHECK(progress.error == EMSGSIZE);
    CHECK(progress.refused == 1);
}

}  // namespace ellicast::sender
