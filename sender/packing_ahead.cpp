#include "sender/packing_ahead.hpp"

#include <utility>

namespace ellicast::sender {
namespace {

// Of the session, a batch: enough that waking the other thread costs little beside them, few enough
// that two batches stay in a cache.
constexpr int kPolls = 4;

}  // namespace

PackingAhead::PackingAhead(Session& session) : session_(session), thread_([this] { work(); }) {}

PackingAhead::~PackingAhead() {
    settle();
    state_ = State::stopping;
    state_.notify_all();
}

void PackingAhead::settle() {
    state_.wait(State::working);  // nothing else follows from that but ready
}

void PackingAhead::begin(Time now, std::vector<Datagram> spent) {
    now_ = now;
    batch_.datagrams = std::move(spent);
    state_ = State::working;
    state_.notify_all();
}

PackingAhead::Batch PackingAhead::take(Time now, std::vector<Datagram> spent) {
    if (state_ == State::idle) begin(now, {});
    settle();
    if (failure_) std::rethrow_exception(failure_);
    Batch batch = std::exchange(batch_, {});
    if (!batch.last) begin(now, std::move(spent));
    return batch;
}

void PackingAhead::work() {
    for (;;) {
        for (State state = state_; state != State::working; state = state_) {
            if (state == State::stopping) return;
            state_.wait(state);
        }
        try {
            session_.recycle(batch_.datagrams);
            for (int k = 0; k < kPolls && !session_.done(); ++k) {
                session_.poll(now_, batch_.datagrams);
            }
            batch_.last = session_.done();
        } catch (...) {
            failure_ = std::current_exception();
            batch_.last = true;
        }
        state_ = State::ready;
        state_.notify_all();
    }
}

}  // namespace ellicast::sender
