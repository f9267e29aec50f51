// tests/receiver/live_schedule_test.cpp
#include "receiver/live_schedule.hpp"

#include <catch2/catch.hpp>

using namespace std::chrono_literals;
using ellicast::receiver::LiveSchedule;
using ellicast::receiver::LiveStep;
using ellicast::receiver::LiveSubject;
using ellicast::receiver::Time;

namespace {

LiveSubject subject_of(std::size_t ellipsoids, std::size_t records, std::uint8_t object = 1) {
    LiveSubject subject;
    subject.object[0] = object;
    subject.ellipsoids = ellipsoids;
    subject.expected = 400;
    subject.records = records;
    return subject;
}

/// Sketched in no time at 1 s, with 10 ellipsoids.
LiveSchedule sketched() {
    LiveSchedule schedule(500ms);
    schedule.begin(1s, LiveStep::sketch, subject_of(10, 100));
    schedule.end(1s);
    return schedule;
}

/// And then made as a whole from 1.5 s to `until`.
LiveSchedule meshed(Time until = 1500ms) {
    LiveSchedule schedule = sketched();
    schedule.begin(1500ms, LiveStep::mesh, subject_of(100, 1000));
    schedule.end(until);
    return schedule;
}

}  // namespace

TEST_CASE("an object is sketched from its first ellipsoid on, and not before") {
    const LiveSchedule schedule(500ms);
    CHECK(schedule.due(1s, subject_of(0, 100)) == LiveStep::none);
    CHECK(schedule.due(1s, subject_of(1, 100)) == LiveStep::sketch);
}

TEST_CASE("it is sketched again with twice the ellipsoids, and with all") {
    const LiveSchedule schedule = sketched();
    CHECK(schedule.due(1001ms, subject_of(19, 150)) == LiveStep::none);
    CHECK(schedule.due(1001ms, subject_of(20, 150)) == LiveStep::sketch);
    CHECK(schedule.due(1001ms, subject_of(199, 150)) == LiveStep::sketch);
}

TEST_CASE("from half of the ellipsoids on it is made coarse, once, and again with all") {
    LiveSchedule schedule = sketched();
    CHECK(schedule.due(1001ms, subject_of(200, 300)) == LiveStep::coarse);
    schedule.begin(1001ms, LiveStep::coarse, subject_of(200, 300));
    schedule.end(1101ms);
    CHECK(schedule.due(1200ms, subject_of(400, 600)) == LiveStep::none);  // rests
    CHECK(schedule.due(1201ms, subject_of(200, 600)) == LiveStep::none);
    CHECK(schedule.due(1201ms, subject_of(399, 600)) == LiveStep::none);
    CHECK(schedule.due(1201ms, subject_of(400, 600)) == LiveStep::coarse);
    // Where the first datagram brought them, a sketch comes first all the same.
    LiveSchedule small(500ms);
    CHECK(small.due(1s, subject_of(400, 400)) == LiveStep::sketch);
    small.begin(1s, LiveStep::sketch, subject_of(400, 400));
    small.end(1s);
    CHECK(small.due(1s, subject_of(400, 400)) == LiveStep::coarse);
}

TEST_CASE("a whole mesh that is due goes before a coarse one") {
    const LiveSchedule schedule = sketched();
    CHECK(schedule.due(1499ms, subject_of(400, 2000)) == LiveStep::coarse);
    CHECK(schedule.due(1500ms, subject_of(400, 2000)) == LiveStep::mesh);
    CHECK(meshed().due(1501ms, subject_of(400, 2000)) == LiveStep::none);
}

TEST_CASE("sketches rest as long as they took") {
    LiveSchedule schedule(500ms);
    schedule.begin(1s, LiveStep::sketch, subject_of(10, 100));
    schedule.end(1020ms);
    CHECK(schedule.due(1039ms, subject_of(40, 100)) == LiveStep::none);
    CHECK(schedule.due(1040ms, subject_of(40, 100)) == LiveStep::sketch);
}

TEST_CASE(
    "the first whole mesh begins an interval after the first sketch, and no sketch after it") {
    LiveSchedule schedule = sketched();
    schedule.begin(1300ms, LiveStep::sketch, subject_of(30, 300));
    schedule.end(1300ms);
    CHECK(schedule.due(1499ms, subject_of(31, 400)) == LiveStep::none);
    CHECK(schedule.due(1500ms, subject_of(31, 400)) == LiveStep::mesh);
    CHECK(schedule.due(1500ms, subject_of(30, 300)) == LiveStep::mesh);
    CHECK(meshed().due(1501ms, subject_of(400, 2000)) == LiveStep::none);
}

TEST_CASE("no live mesh begins while another is in the making") {
    LiveSchedule schedule(500ms);
    schedule.begin(1s, LiveStep::sketch, subject_of(10, 10));
    CHECK(schedule.busy());
    CHECK(schedule.due(60s, subject_of(200, 1000)) == LiveStep::none);
}

TEST_CASE("after a quick mesh the next begins an interval after its beginning") {
    const LiveSchedule schedule = meshed(1600ms);
    CHECK(schedule.due(1999ms, subject_of(100, 1100)) == LiveStep::none);
    CHECK(schedule.due(2000ms, subject_of(100, 1100)) == LiveStep::mesh);
}

TEST_CASE("after a slow mesh comes a rest as long as it took") {
    const LiveSchedule schedule = meshed(3500ms);
    CHECK(schedule.due(5499ms, subject_of(100, 1100)) == LiveStep::none);
    CHECK(schedule.due(5500ms, subject_of(100, 1100)) == LiveStep::mesh);
}

TEST_CASE("no live mesh begins while nothing has changed") {
    const LiveSchedule schedule = meshed();
    CHECK(schedule.due(60s, subject_of(100, 1000)) == LiveStep::none);
    CHECK(schedule.due(60s, subject_of(100, 1001)) == LiveStep::mesh);
}

TEST_CASE("another object is sketched at once, and one that comes again is not") {
    LiveSchedule schedule = meshed();
    CHECK(schedule.due(1501ms, subject_of(5, 60, 2)) == LiveStep::sketch);
    schedule.begin(1501ms, LiveStep::sketch, subject_of(5, 60, 2));
    schedule.end(1501ms);
    CHECK(schedule.due(1502ms, subject_of(100, 1001)) == LiveStep::none);
    CHECK(schedule.due(2000ms, subject_of(100, 1001)) == LiveStep::mesh);
    CHECK(schedule.due(2000ms, subject_of(5, 61, 2)) == LiveStep::none);
    CHECK(schedule.due(2001ms, subject_of(5, 61, 2)) == LiveStep::mesh);
}

TEST_CASE("many objects are remembered, and more than that are forgotten") {
    LiveSchedule schedule(500ms);
    for (std::uint8_t object = 0; object < 65; ++object) {
        REQUIRE(schedule.due(1s, subject_of(5, 60, object)) == LiveStep::sketch);
        schedule.begin(1s, LiveStep::sketch, subject_of(5, 60, object));
        schedule.end(1s);
    }
    CHECK(schedule.due(1s, subject_of(5, 60, 0)) == LiveStep::sketch);
    CHECK(schedule.due(1s, subject_of(5, 60, 1)) == LiveStep::none);
}

TEST_CASE("live meshes take at most half of the time, however long each takes") {
    LiveSchedule schedule(100ms);
    Time busy{};
    std::size_t records = 0;
    Time now = 0ms;
    for (int k = 0; k < 1000; ++k, ++records, now += 1ms) {
        const LiveSubject subject = subject_of(records, records, static_cast<std::uint8_t>(k % 3));
        const LiveStep step = schedule.due(now, subject);
        if (step == LiveStep::none) continue;
        const Time takes = 20ms * (1 + k % 7);
        schedule.begin(now, step, subject);
        now += takes;
        busy += takes;
        schedule.end(now);
    }
    CHECK(busy > 0ms);
    CHECK(2 * busy <= now + 140ms);  // the last one may not have rested yet
}
