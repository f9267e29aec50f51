// receiver/session.cpp
#include "receiver/session.hpp"

#include <algorithm>
#include <utility>

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

Session::Session(const SessionOptions& options, GateOptions gate, Time now)
    : options_(options),
      start_(now),
      last_arrival_(now),
      gate_(std::move(gate)),
      admit_([this](Time arrived, const Source& source, std::span<const std::uint8_t> clear) {
          admit(arrived, source, clear);
      }),
      store_(options.limits),
      catalogue_(options.limits.groups, options.limits.groups),
      streams_(now, options.limits.groups) {
    if (options.loss.any()) loss_.emplace(options.loss);
}

void Session::on_datagram(Time now, const Source& source, std::span<const std::uint8_t> bytes) {
    if (finished()) return;
    last_arrival_ = now;
    if (gate_.stands_open_for(bytes)) {
        admit(now, source, bytes);
    } else if (const auto fault = gate_.offer(now, source, bytes, admit_)) {
        malformed_.add(*fault);
    }
}

bool Session::work() {
    return !finished() && gate_.waiting() > 0 && gate_.work(admit_);
}

void Session::admit(Time now, const Source& source, std::span<const std::uint8_t> bytes) {
    if (finished()) return;
    if (loss_) {
        loss_->offer(source, bytes, [&](const Source& from, std::span<const std::uint8_t> rest) {
            deliver(now, from, rest);
        });
    } else {
        deliver(now, source, bytes);
    }
    // Only these make anything complete; and what they make outdated is given up.
    if (store_.changes() + catalogue_.changes() != looked_at_) look_for_completion(now);
}

void Session::look_for_completion(Time now) {
    looked_at_ = store_.changes() + catalogue_.changes();
    forget_outdated();
    if (!ends_when_complete()) return;
    if (goal_of(pages(), catalogue_, options_.pages).complete) finish(now, EndReason::complete);
}

void Session::forget_outdated() {
    for (;;) {
        const auto old = outdated(pages(), catalogue_);
        if (old.empty()) return;
        store_.forget(*old.front());
    }
}

std::vector<Page> Session::pages() const {
    return chosen_pages(store_, catalogue_, options_.pages);
}

const RecordStore::Group* Session::shown() const {
    const std::vector<Page> chosen = pages();
    return chosen.empty() ? nullptr : &chosen.front().best();
}

Time Session::last_heard(const RecordStore::Group& shown) const {
    Time latest = shown.last_seen;
    for (const RecordStore::Group& group : store_.groups()) {
        if (same_station(group.sender, shown.sender)) latest = std::max(latest, group.last_seen);
    }
    return latest;
}

void Session::deliver(Time now, const Source& source, std::span<const std::uint8_t> bytes) {
    const auto datagram = protocol::parse_datagram(bytes);
    if (!datagram) {
        malformed_.add(datagram.error());
        return;
    }
    const SenderKey sender{source, datagram->header.session};
    if (store_.accept(now, sender, *datagram)) {
        if (!first_heard_) first_heard_ = now;
        catalogue_.on_datagram(now, sender, *datagram);
        const Authenticity& keys = source.authenticity;
        const std::size_t security =
            protocol::security_bytes({.sealed = keys.sealed, .is_signed = keys.is_signed});
        streams_.on_datagram(now, sender, datagram->header, bytes.size() + security);
    }
}

bool Session::ends_when_complete() const {
    return options_.until != Until::forever;
}

std::optional<Session::Deadline> Session::next_deadline() const {
    const std::vector<Page> chosen = pages();
    // Nothing of a wanted page: then anybody's silence counts.
    const RecordStore::Group* const heard =
        chosen.empty() ? store_.shown() : &chosen.front().current();
    if (!heard) {
        if (!options_.wait) return std::nullopt;
        return Deadline{start_ + *options_.wait, EndReason::waited};
    }
    if (options_.until == Until::forever) return std::nullopt;
    Deadline next{last_heard(*heard) + options_.idle_timeout, EndReason::idle};
    const auto consider = [&](std::optional<Time> seen, EndReason reason) {
        if (seen && *seen + kGrace < next.at) next = {*seen + kGrace, reason};
    };
    const PageGoal goal = goal_of(chosen, catalogue_, options_.pages);
    if (options_.until != Until::complete) consider(goal.stream_end, EndReason::stream_end);
    if (options_.until == Until::round) consider(goal.full_round_end, EndReason::round);
    return next;
}

void Session::poll(Time now) {
    // While datagrams wait nobody knows yet who is silent.
    if (finished() || work() || finished()) return;
    store_.merge_silent(now);
    look_for_completion(now);
    if (finished()) return;
    const std::optional<Deadline> next = next_deadline();
    if (next && next->at <= now) finish(now, next->reason);
}

std::optional<Time> Session::next_wakeup() const {
    if (finished()) return std::nullopt;
    if (gate_.waiting() > 0) return last_arrival_;
    const std::optional<Deadline> next = next_deadline();
    if (!next) return std::nullopt;
    return next->at;
}

void Session::interrupt(Time now) {
    while (work()) continue;  // what has arrived was received
    if (!finished()) finish(now, EndReason::interrupted);
}

void Session::finish(Time now, EndReason reason) {
    if (loss_) {
        loss_->flush([&](const Source& from, std::span<const std::uint8_t> rest) {
            deliver(last_arrival_, from, rest);
        });
    }
    store_.merge_silent(now);
    const bool complete =
        ends_when_complete() && goal_of(pages(), catalogue_, options_.pages).complete;
    ends_by_ = complete ? EndReason::complete : reason;
}

bool Session::is_page_beside(const RecordStore::Group& shown,
                             const RecordStore::Group& group) const {
    if (!options_.pages.all || !same_station(group.sender, shown.sender)) return false;
    const Contents* const contents = catalogue_.of(group.sender);
    return contents && contents->line_of(group.object) != nullptr;
}

SessionSummary Session::summary(Time now) const {
    SessionSummary summary;
    summary.ends_by = ends_by_;
    summary.malformed = malformed_;
    summary.refused = gate_.refused();
    summary.unverified_dropped = gate_.unverified_dropped();
    summary.store = store_.counts();
    const RecordStore::Group* const shown = this->shown();
    if (!shown) return summary;
    summary.authenticity = shown->sender.source.authenticity;
    const bool ended = ends_by_ == EndReason::stream_end || ends_by_ == EndReason::idle ||
                       now - last_heard(*shown) >= options_.idle_timeout;
    summary.datagrams = streams_.counts(shown->senders, ended);
    summary.conflicting = shown->ellipsoids.conflicting() + shown->vertices.conflicting();
    for (const RecordStore::Group& group : store_.groups()) {
        if (&group == shown || is_page_beside(*shown, group)) continue;
        ++summary.other_groups;
        summary.other_datagrams += group.datagrams;
        if (group.object == shown->object && group.hint_bytes != shown->hint_bytes) {
            summary.contradictory_hints += group.datagrams;
        }
    }
    return summary;
}

}  // namespace ellicast::receiver
