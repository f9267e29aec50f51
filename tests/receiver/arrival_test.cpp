// tests/receiver/arrival_test.cpp
#include "receiver/arrival.hpp"

#include <catch2/catch.hpp>
#include <chrono>

using namespace ellicast::receiver;
using namespace std::chrono_literals;

TEST_CASE("a datagram arrived when the kernel says, by our own clock") {
    const Time wall = 1'700'000'000s;
    CHECK(arrival_time(100s, wall, wall - 30ms, 99s) == 100s - 30ms);
    CHECK(arrival_time(100s, wall, wall, 99s) == 100s);
}

TEST_CASE("a wall clock that is set by hours moves no arrival out of the time it waited in") {
    const Time wall = 1'700'000'000s;
    const Time step = GENERATE(2h, 9000h);
    const Time stamp = wall - 30ms;
    CHECK(arrival_time(100s, wall + step, stamp, 99s) == 99s);
    CHECK(arrival_time(100s, wall - step, stamp, 99s) == 100s);
    CHECK(arrival_time(100s, wall + step, stamp, 100s) == 100s);
    CHECK(arrival_time(100s, 0s, stamp, 99s) == 100s);  // a clock before it was ever set
}
