#include "receiver/live_schedule.hpp"

#include <algorithm>
#include <cassert>

namespace ellicast::receiver {

LiveSchedule::LiveSchedule(Time interval) : interval_(interval) {
    assert(interval > Time::zero());
}

const LiveSchedule::Known* LiveSchedule::known(const protocol::ObjectId& object) const {
    const auto found = std::find_if(known_.begin(), known_.end(), [&](const Known& entry) {
        return entry.subject.object == object;
    });
    return found == known_.end() ? nullptr : &*found;
}

/// What shows the ellipsoids that came since.
LiveStep LiveSchedule::quick_step(const Known& known, const LiveSubject& subject) {
    const bool half = 2 * subject.ellipsoids >= subject.expected;
    if (known.step == LiveStep::sketch && half) return LiveStep::coarse;
    const std::size_t before = known.subject.ellipsoids;
    if (known.step == LiveStep::mesh || subject.ellipsoids == before) return LiveStep::none;
    const bool many = subject.ellipsoids >= 2 * before || subject.ellipsoids == subject.expected;
    if (!many) return LiveStep::none;
    return half ? LiveStep::coarse : LiveStep::sketch;
}

LiveStep LiveSchedule::due(Time now, const LiveSubject& subject) const {
    if (busy_ || subject.ellipsoids == 0 || now < rests_until_) return LiveStep::none;
    const Known* const before = known(subject.object);
    if (!before) return LiveStep::sketch;
    // What is quick leaves out the vertices, whatever it was made of.
    const bool news = before->step != LiveStep::mesh || subject.records != before->subject.records;
    if (news && now >= before->next_mesh) return LiveStep::mesh;
    return quick_step(*before, subject);
}

void LiveSchedule::begin(Time now, LiveStep step, const LiveSubject& subject) {
    assert(!busy_ && step != LiveStep::none);
    Known entry{subject, step, now + interval_};
    if (const Known* const before = known(subject.object)) {
        if (step != LiveStep::mesh) entry.next_mesh = before->next_mesh;
        known_.erase(known_.begin() + (before - known_.data()));
    }
    if (known_.size() == kMostObjects) known_.erase(known_.begin());
    known_.push_back(entry);
    busy_ = true;
    begun_ = now;
}

void LiveSchedule::end(Time now) {
    assert(busy_);
    busy_ = false;
    rests_until_ = now + (now - begun_);
}

}  // namespace ellicast::receiver
