// tests/common/text_values_test.cpp
#include "common/text_values.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>

using namespace ellicast::common;

namespace {

/// How every refusal begins.
std::string quoted(const char* text) {
    return std::string("'").append(text).append("': ");
}

}  // namespace

TEST_CASE("rates are decimal bits per second") {
    CHECK(parse_rate("20M") == 20'000'000);
    CHECK(parse_rate("500k") == 500'000);
    CHECK(parse_rate("1G") == 1'000'000'000);
    CHECK(parse_rate("1") == 1);
    CHECK(parse_rate("64000") == 64'000);
    CHECK(parse_rate("2.5k") == 2'500);
    CHECK(parse_rate("0.1M") == 100'000);
    CHECK(parse_rate("1e6") == 1'000'000);
    CHECK(parse_rate("1000G") == 1'000'000'000'000);
}

TEST_CASE("what is no rate is refused with the text in quotes") {
    for (const char* text :
         {"",    "k",  "M",     "20 M",  "20m", "20K", "20MB", "20Mbit", "-20M", "+20M", "0",
          "0.5", "0M", "1001G", "1e400", "nan", "inf", "0x10", "20M ",   " 20M", "2,5M", "1.2.3"}) {
        CAPTURE(text);
        CHECK_THROWS_WITH(parse_rate(text), Catch::StartsWith(quoted(text)));
    }
}

TEST_CASE("endpoints are read in all their forms") {
    CHECK(parse_endpoint("example.org:5004") == Endpoint{"example.org", 5004});
    CHECK(parse_endpoint("example.org") == Endpoint{"example.org", {}});
    CHECK(parse_endpoint("127.0.0.1:1") == Endpoint{"127.0.0.1", 1});
    CHECK(parse_endpoint(":5004") == Endpoint{"", 5004});
    CHECK(parse_endpoint(":0") == Endpoint{"", 0});
    CHECK(parse_endpoint("[::1]:65535") == Endpoint{"::1", 65535});
    CHECK(parse_endpoint("[::]") == Endpoint{"::", {}});
    CHECK(parse_endpoint("[fe80::1%eth0]:9") == Endpoint{"fe80::1%eth0", 9});
    CHECK(parse_endpoint("[ff02::1]:5004") == Endpoint{"ff02::1", 5004});
}

TEST_CASE("what is no endpoint is refused with the text in quotes") {
    for (const char* text :
         {"",        ":",       "host:",     "host:x",     "host:65536", "host:-1",
          "host:+1", "host: 1", "host:1 ",   "host:5004x", "::1",        "::1:5004",
          "fe80::1", "a:1:2",   "[::1",      "[::1]5004",  "[::1]:",     "[::1]:x",
          "[]",      "[]:5004", "[[::1]]:5", "ho st:1",    "host\n:1",   "h[:1"}) {
        CAPTURE(text);
        CHECK_THROWS_WITH(parse_endpoint(text), Catch::StartsWith(quoted(text)));
    }
}
