#include "sender/stream_description.hpp"

#include <catch2/catch.hpp>

namespace ellicast::sender {
namespace {

Options options_for(std::uint64_t rate = 20'000'000) {
    Options options;
    options.port = 6000;
    options.bits_per_second = rate;
    return options;
}

const Identity kIdentity{{0xff, 1, 2, 3, 4, 5, 6, 7}, 9, 65'000, 0};

/// What a receiver reads of it.
protocol::SessionDescription read_of(const Options& options, const StreamWay& way,
                                     const std::vector<std::string>& pages = {"horse"},
                                     const std::string& key = "") {
    const auto described = describe_stream(options, kIdentity, pages, way, key);
    auto read = protocol::parse_session_description(protocol::session_description_text(described));
    CHECK(read == described);
    return read;
}

}  // namespace

TEST_CASE("a group's description names its TTL and the sender as its source") {
    Options options = options_for(19'999'001);
    const auto v4 = read_of(options, {"239.255.0.1", "192.0.2.1"});
    CHECK(v4.ttl == 1);  // RFC 1112, and what the socket does
    CHECK(v4.source == "192.0.2.1");
    CHECK(v4.port == 6000);
    CHECK(v4.payload_type == protocol::kRtpPayloadType);
    CHECK(v4.kbit_per_second == 20'000);
    CHECK(v4.ssrc == 9u);
    CHECK(v4.cname == "ff01020304050607");
    CHECK(v4.session == 0x7f01020304050607);
    options.ttl = 7;
    CHECK(read_of(options, {"239.255.0.1", "192.0.2.1"}).ttl == 7);
    const auto v6 = read_of(options, {"ff35::77", "fd77::1"});
    CHECK_FALSE(v6.ttl.has_value());
    CHECK(v6.source == "fd77::1");
    CHECK(read_of(options, {"239.255.0.1", ""}).source.empty());
}

TEST_CASE("a host's description has neither") {
    Options options = options_for(0);
    options.ttl = 7;
    const auto read = read_of(options, {"192.0.2.7", "192.0.2.1"}, {"a", "b", "c"});
    CHECK_FALSE(read.ttl.has_value());
    CHECK(read.source.empty());
    CHECK(read.sender == "192.0.2.1");
    CHECK(read.kbit_per_second == 0);  // unpaced
    CHECK(read.name == "3 pages");
    CHECK(read_of(options, {"::1", "::1"}).address == "::1");
}

TEST_CASE("what keys do is told") {
    Options options = options_for();
    CHECK_FALSE(read_of(options, {"192.0.2.7", ""}).sealed);
    options.psk = "team";
    const std::string key(64, '5');
    const auto read = read_of(options, {"192.0.2.7", ""}, {"horse"}, key);
    CHECK(read.sealed);
    CHECK(read.public_key == key);
    CHECK(read.wire_version == protocol::kWireVersion);
    CHECK(read.datagram_bytes == 1200);
}

}  // namespace ellicast::sender
