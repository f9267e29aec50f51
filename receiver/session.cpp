// receiver/session.cpp
#include "receiver/session.hpp"

#include <algorithm>

namespace ellicast::receiver {
namespace {

// DESIGN section 5: what the network let fall behind the last datagram may still come.
constexpr Time kGrace = std::chrono::milliseconds(250);

}  // namespace

std::string_view to_string(EndReason reason) {
    switch (reason) {
        case EndReason::none:
            return "none";
        case EndReason::complete:
            return "complete";
        case EndReason::stream_end:
            return "stream_end";
        case EndReason::round:
            return "round";
        case EndReason::idle:
            return "idle";
        case EndReason::waited:
            return "waited";
        case EndReason::interrupted:
            return "interrupted";
    }
    return "none";
}

Session::Session(const SessionOptions& options, Time now)
    : options_(options),
      start_(now),
      last_arrival_(now),
      store_(options.limits),
      streams_(now, options.limits.groups) {
    if (options.loss.any()) loss_.emplace(options.loss);
}

void Session::on_datagram(Time now, const Source& source, std::span<const std::uint8_t> bytes) {
    if (finished()) return;
    last_arrival_ = now;
    if (loss_) {
        loss_->offer(source, bytes, [&](const Source& from, std::span<const std::uint8_t> rest) {
            deliver(now, from, rest);
        });
    } else {
        deliver(now, source, bytes);
    }
    const RecordStore::Group* const shown = store_.shown();
    if (shown && ends_when_complete() && shown->complete()) finish(now, EndReason::complete);
}

void Session::deliver(Time now, const Source& source, std::span<const std::uint8_t> bytes) {
    const auto datagram = protocol::parse_datagram(bytes);
    if (!datagram) {
        malformed_.add(datagram.error());
        return;
    }
    const SenderKey sender{source, datagram->header.session};
    if (store_.accept(now, sender, *datagram)) {
        streams_.on_datagram(now, sender, datagram->header, bytes.size());
    }
}

bool Session::ends_when_complete() const {
    return options_.until != Until::forever;
}

std::optional<Session::Deadline> Session::next_deadline() const {
    const RecordStore::Group* const shown = store_.shown();
    if (!shown) {
        if (!options_.wait) return std::nullopt;
        return Deadline{start_ + *options_.wait, EndReason::waited};
    }
    if (options_.until == Until::forever) return std::nullopt;
    Deadline next{*store_.last_heard() + options_.idle_timeout, EndReason::idle};
    const auto consider = [&](std::optional<Time> seen, EndReason reason) {
        if (seen && *seen + kGrace < next.at) next = {*seen + kGrace, reason};
    };
    if (options_.until != Until::complete) {
        consider(shown->progress.stream_end(), EndReason::stream_end);
    }
    if (options_.until == Until::round) {
        consider(shown->progress.full_round_end(), EndReason::round);
    }
    return next;
}

void Session::poll(Time now) {
    if (finished()) return;
    store_.merge_silent(now);
    const std::optional<Deadline> next = next_deadline();
    if (next && next->at <= now) finish(now, next->reason);
}

std::optional<Time> Session::next_wakeup() const {
    if (finished()) return std::nullopt;
    const std::optional<Deadline> next = next_deadline();
    if (!next) return std::nullopt;
    return next->at;
}

void Session::interrupt(Time now) {
    if (!finished()) finish(now, EndReason::interrupted);
}

void Session::finish(Time now, EndReason reason) {
    if (loss_) {
        loss_->flush([&](const Source& from, std::span<const std::uint8_t> rest) {
            deliver(last_arrival_, from, rest);
        });
    }
    store_.merge_silent(now);
    const RecordStore::Group* const shown = store_.shown();
    const bool complete = shown && ends_when_complete() && shown->complete();
    ends_by_ = complete ? EndReason::complete : reason;
}

SessionSummary Session::summary(Time now) const {
    SessionSummary summary;
    summary.ends_by = ends_by_;
    summary.malformed = malformed_;
    summary.store = store_.counts();
    const RecordStore::Group* const shown = store_.shown();
    if (!shown) return summary;
    const bool ended = ends_by_ == EndReason::stream_end || ends_by_ == EndReason::idle ||
                       now - *store_.last_heard() >= options_.idle_timeout;
    summary.datagrams = streams_.counts(shown->senders, ended);
    summary.conflicting = shown->ellipsoids.conflicting() + shown->vertices.conflicting();
    for (const RecordStore::Group& group : store_.groups()) {
        if (&group == shown) continue;
        ++summary.other_groups;
        summary.other_datagrams += group.datagrams;
        if (group.object == shown->object && group.hint_bytes != shown->hint_bytes) {
            summary.contradictory_hints += group.datagrams;
        }
    }
    return summary;
}

}  // namespace ellicast::receiver
