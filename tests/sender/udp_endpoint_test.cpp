// tests/sender/udp_endpoint_test.cpp: over the loopback interface.
#include "sender/udp_endpoint.hpp"

#include <catch2/catch.hpp>
#include <csignal>
#include <thread>

#include "tests/sender/made_objects.hpp"
#include "tests/support/udp_sink.hpp"

namespace ellicast::sender {
namespace {

using namespace std::chrono_literals;
using tests::UdpSink;

Session made_session(std::uint64_t bits_per_second, std::uint32_t rounds = 1,
                     std::size_t vertices = 5000) {
    PlanOptions plan;
    plan.rounds = rounds;
    SessionOptions options;
    options.bits_per_second = bits_per_second;
    std::vector<RoundPlan> plans{RoundPlan(tests::made_object(50, vertices), plan)};
    return {std::move(plans), options};
}

}  // namespace

TEST_CASE("what the session hands out arrives, byte for byte and in order, on IPv4 and IPv6") {
    const bool v6 = GENERATE(false, true);
    UdpSink sink(v6);
    const bool segments = GENERATE(false, true);
    UdpEndpoint endpoint(v6 ? "::1" : "127.0.0.1", sink.port(), 1200, {.segments = segments});
    CHECK(endpoint.ip_udp_bytes() == (v6 ? 48 : 28));
    CHECK(endpoint.peer() == (v6 ? "[::1]:" : "127.0.0.1:") + std::to_string(sink.port()));
    Session session = made_session(50'000'000);
    REQUIRE(endpoint.run(session, {}));
    REQUIRE(session.done());

    const auto& datagrams = sink.datagrams();
    REQUIRE(datagrams.size() == session.counts().offered);
    CHECK(endpoint.counts().sent == datagrams.size());
    std::uint64_t bytes = 0;
    std::uint32_t ordinal = 0;
    for (const Datagram& datagram : datagrams) {
        const auto view = protocol::parse_datagram(datagram);
        REQUIRE(view.has_value());
        REQUIRE(view->header.ordinal == ordinal++);
        bytes += datagram.size();
    }
    CHECK(endpoint.counts().bytes == bytes);
    CHECK(endpoint.counts().refused == 0);
}

TEST_CASE("a host name is resolved") {
    UdpSink sink;
    UdpEndpoint endpoint("localhost", sink.port(), 1200);
    CHECK((endpoint.ip_udp_bytes() == 28 || endpoint.ip_udp_bytes() == 48));
}

TEST_CASE("the wall clock shows no more than the rate") {
    UdpSink sink;
    UdpEndpoint endpoint("127.0.0.1", sink.port(), 1200);
    Session session = made_session(2'000'000);
    const Time start = UdpEndpoint::now();
    REQUIRE(endpoint.run(session, {}));
    const double seconds = std::chrono::duration<double>(UdpEndpoint::now() - start).count();
    const EndpointCounts& counts = endpoint.counts();
    const double bits = 8.0 * static_cast<double>(counts.bytes + 28 * (counts.sent - 1) - 1200);
    CHECK(seconds >= 0.99 * bits / 2e6);
}

TEST_CASE("nobody listening is normal: everything is sent, and the answers are counted") {
    std::uint16_t port = 0;
    { port = UdpSink().port(); }  // free again
    UdpEndpoint endpoint("127.0.0.1", port, 1200);
    Session session = made_session(50'000'000);
    REQUIRE(endpoint.run(session, {}));
    CHECK(endpoint.counts().sent == session.counts().offered);
    CHECK(endpoint.counts().refused == 0);
    CHECK(endpoint.counts().unreachable > 0);
}

TEST_CASE("an address that cannot be, a size that does not fit: one line that says so") {
    const auto reason = [](const std::string& host, std::size_t bytes) {
        try {
            UdpEndpoint endpoint(host, 5004, bytes);
        } catch (const SendError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK_THAT(reason("no such host", 1200), Catch::Contains("'no such host'"));
    CHECK_THAT(reason("127.0.0.1.5", 1200), Catch::Contains("'127.0.0.1.5'"));
    CHECK(reason("127.0.0.1", 65'507).empty());
    // 65 507 + 48 bytes are more than the 65 536 of the loopback interface.
    CHECK_THAT(reason("::1", 65'507), Catch::Contains("--datagram 65488"));
}

TEST_CASE("a datagram as large as UDP allows goes through") {
    UdpSink sink;
    UdpEndpoint endpoint("127.0.0.1", sink.port(), 65'507);
    PlanOptions plan;
    plan.datagram_bytes = 65'507;
    std::vector<RoundPlan> plans{RoundPlan(tests::made_object(50, 20'000), plan)};
    Session session(std::move(plans), SessionOptions{});
    REQUIRE(endpoint.run(session, {}));
    CHECK(sink.datagrams().size() == session.counts().offered);
    CHECK(endpoint.counts().refused == 0);
}

TEST_CASE("a signal ends a carousel, also an unpaced one") {
    const std::uint64_t rate = GENERATE(0u, 1'000u, 10'000'000u);
    const int number = GENERATE(SIGINT, SIGTERM);
    UdpSink sink;
    UdpEndpoint endpoint("127.0.0.1", sink.port(), 1200);
    Session session = made_session(rate, 0, 500);
    std::thread killer([number] {
        std::this_thread::sleep_for(150ms);
        std::raise(number);
    });
    const Time start = UdpEndpoint::now();
    CHECK_FALSE(endpoint.run(session, {}));
    killer.join();
    CHECK(UdpEndpoint::now() - start < 20s);
    CHECK(endpoint.counts().sent > 0);
}

}  // namespace ellicast::sender
