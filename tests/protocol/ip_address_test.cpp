#include "protocol/ip_address.hpp"

#include <arpa/inet.h>

#include <catch2/catch.hpp>
#include <string>

#include "common/random.hpp"

namespace {

using namespace ellicast::protocol;

/// What the system makes of the text.
std::optional<IpAddress> oracle(const std::string& text) {
    IpAddress address;
    if (::inet_pton(AF_INET, text.c_str(), address.bytes.data()) == 1) return address;
    address.v6 = true;
    address.bytes.fill(0);
    if (::inet_pton(AF_INET6, text.c_str(), address.bytes.data()) == 1) return address;
    return std::nullopt;
}

}  // namespace

TEST_CASE("addresses are read as the system reads them") {
    const std::string text =
        GENERATE("192.0.2.7", "0.0.0.0", "255.255.255.255", "256.0.0.1", "1.2.3", "1.2.3.4.5",
                 "01.2.3.4", "1.2.3.4 ", " 1.2.3.4", "1.2.3.", "", ".", "1..2.3", "-1.2.3.4",
                 "::", "::1", "1::", "2001:db8::7", "2001:DB8:0:0:0:0:0:7", "1:2:3:4:5:6:7:8",
                 "1:2:3:4:5:6:7", "1:2:3:4:5:6:7::", "::2:3:4:5:6:7:8", "1::2:3:4:5:6:7:8",
                 "1:2:3:4:5:6:7:8:9", "1:2:3:4:5:6:7:8::", ":1", "1:", ":", ":::", "1::2::3",
                 "12345::", "00001::", "g::", "::ffff:192.0.2.7", "1:2:3:4:5:6:1.2.3.4",
                 "1:2:3:4:5:6:7:1.2.3.4", "::1.2.3.4:5", "::1.2.3", "fe80::1%eth0", "[::1]", "::-1",
                 "::+1", "0x1::", "ff15::77", "239.255.0.1");
    CAPTURE(text);
    CHECK(parse_ip_address(text) == oracle(text));
}

TEST_CASE("any text of the letters of addresses is read as the system reads it") {
    const std::string letters = "0012fF:::..";
    ellicast::common::Random random(7);
    int read = 0;
    for (int k = 0; k < 200'000; ++k) {
        std::string text;
        for (auto length = random.below(16); length > 0; --length) {
            text += letters[random.below(letters.size())];
        }
        const auto expected = oracle(text);
        read += expected ? 1 : 0;
        if (parse_ip_address(text) != expected) FAIL("'" << text << "'");
    }
    CHECK(read > 100);
}

TEST_CASE("groups are told from hosts") {
    const auto group = [](const char* text) {
        return is_multicast(parse_ip_address(text).value());
    };
    CHECK(group("224.0.0.1"));
    CHECK(group("239.255.255.255"));
    CHECK_FALSE(group("223.255.255.255"));
    CHECK_FALSE(group("240.0.0.0"));
    CHECK(group("ff02::1"));
    CHECK_FALSE(group("feff::1"));
    CHECK_FALSE(group("::ffff:224.0.0.1"));
}
