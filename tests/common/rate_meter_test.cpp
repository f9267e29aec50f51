// tests/common/rate_meter_test.cpp
#include "common/rate_meter.hpp"

#include <catch2/catch.hpp>

using ellicast::common::RateMeter;
using namespace std::chrono_literals;

TEST_CASE("the recent rate is that of the last seconds") {
    RateMeter meter;
    CHECK(meter.bits_per_second() == 0.0);
    meter.add(10s, 0);
    CHECK(meter.bits_per_second() == 0.0);
    meter.add(10s, 5);
    CHECK(meter.bits_per_second() == 0.0);
    for (int k = 1; k <= 20; ++k) meter.add(10s + k * 1s, static_cast<std::uint64_t>(k) * 1000);
    CHECK(meter.bits_per_second() == Approx(1000.0));
    for (int k = 21; k <= 40; ++k) meter.add(10s + k * 1s, 20'000);
    CHECK(meter.bits_per_second() == 0.0);
    meter.add(51s, 10);  // another count
    CHECK(meter.bits_per_second() == 0.0);
}
