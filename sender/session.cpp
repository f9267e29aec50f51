// sender/session.cpp
#include "sender/session.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <memory>
#include <utility>

#include "protocol/section_filter.hpp"

namespace ellicast::sender {
namespace {

using common::BernoulliLoss;
using common::LossSequence;
using common::LossStream;

// What a late wake-up may catch up on. Twice what a busy desktop oversleeps, and 12 kB at 20
// Mbit/s: no receiver's buffer minds.
constexpr Time kBurst = std::chrono::milliseconds(5);

// Datagrams whose memory is kept for others: more than leave at one time.
constexpr std::size_t kMostSpent = 512;

LossSequence section_loss(double probability, std::uint64_t seed, LossStream stream) {
    return {BernoulliLoss{probability}, common::stream_seed(seed, stream)};
}

/// 90 kHz ticks; wraps around as RTP wants it.
std::uint32_t rtp_ticks(Time elapsed) {
    constexpr std::int64_t kNanosecondsPer9Ticks = 100'000;
    static_assert(protocol::kRtpClockHz == 90'000);
    return static_cast<std::uint32_t>(static_cast<std::uint64_t>(elapsed.count()) * 9 /
                                      kNanosecondsPer9Ticks);
}

}  // namespace

Session::Session(std::vector<RoundPlan> plans, const SessionOptions& options,
                 std::optional<DatagramSecurity> security)
    : plans_(std::move(plans)),
      versions_(plans_.size(), 1),
      first_rounds_(plans_.size(), 0),
      options_(options),
      security_(std::move(security)),
      impairment_(options.impairment),
      lost_ellipsoids_(section_loss(options.impairment.drop_ellipsoids, options.impairment.seed,
                                    LossStream::ellipsoids)),
      lost_vertices_(section_loss(options.impairment.drop_vertices, options.impairment.seed,
                                  LossStream::vertices)),
      sequence_(options.first_sequence) {
    assert(!plans_.empty());
    assert(std::all_of(plans_.begin(), plans_.end(), [&](const RoundPlan& plan) {
        return plan.rounds() == plans_.front().rounds();
    }));
    if (plans_.size() > 1) tell_contents();
    if (security_) security_bytes_ = protocol::security_bytes(security_->protection());
    if (options.bits_per_second > 0) bucket_.emplace(options.bits_per_second, kBurst);
}

void Session::replace(std::size_t page, RoundPlan plan) {
    assert(page < plans_.size() && plan.rounds() == plans_.front().rounds());
    waiting_.insert_or_assign(page, std::move(plan));
    if (page == plan_ && ordinal_ == 0) begin_turn();
}

/// The page's new object, where one waits, takes its place.
void Session::begin_turn() {
    const auto next = waiting_.find(plan_);
    if (next == waiting_.end()) return;
    retired_.push_back(std::exchange(plans_[plan_], std::move(next->second)));
    waiting_.erase(next);
    ++versions_[plan_];
    first_rounds_[plan_] = round_;
    tell_contents();
}

/// The table of contents, to all plans.
void Session::tell_contents() {
    auto contents = std::make_shared<Contents>();
    for (std::size_t page = 0; page < plans_.size(); ++page) {
        const BroadcastObject& object = plans_[page].object();
        contents->push_back({.page = static_cast<std::uint16_t>(page),
                             .pages = static_cast<std::uint16_t>(plans_.size()),
                             .version = versions_[page],
                             .object = object.id,
                             .components = object.hint.components,
                             .euler_all = object.hint.euler_all,
                             .ellipsoids = object.hint.ellipsoids,
                             .vertices = object.hint.vertices,
                             .name = object.description.name});
    }
    for (std::size_t page = 0; page < plans_.size(); ++page) {
        plans_[page].set_place({first_rounds_[page], static_cast<std::uint16_t>(page),
                                plans_[page].paged() ? contents : nullptr});
    }
}

std::vector<RoundPlan> Session::take_retired() {
    return std::exchange(retired_, {});
}

bool Session::cut_short() const {
    return finishing_ && (plans_.front().rounds() == 0 || round_ < plans_.front().rounds());
}

void Session::recycle(std::vector<Datagram>& spent) {
    const std::size_t room = kMostSpent - std::min(kMostSpent, spent_.size());
    const auto kept = static_cast<std::ptrdiff_t>(std::min(room, spent.size()));
    spent_.insert(spent_.end(), std::move_iterator(spent.begin()),
                  std::move_iterator(spent.begin() + kept));
    spent.clear();
}

Datagram Session::take_spent() {
    if (spent_.empty()) return {};
    Datagram memory = std::move(spent_.back());
    spent_.pop_back();
    return memory;
}

void Session::poll(Time now, std::vector<Datagram>& out) {
    if (done_) return;
    if (!start_) start_ = now;
    if (now < *start_) return;
    const std::uint32_t timestamp = options_.first_timestamp + rtp_ticks(now - *start_);
    for (std::size_t k = 0; k < kBatch && !done_; ++k) {
        if (bucket_ && bucket_->ready_at() > now) break;
        Datagram datagram = plans_[plan_].datagram(
            round_, ordinal_, {sequence_, timestamp, options_.ssrc}, take_spent());
        const std::size_t price = datagram.size() + security_bytes_ + options_.ip_udp_bytes;
        if (bucket_) {
            [[maybe_unused]] const bool paid = bucket_->take(now, price);
            assert(paid);
        }
        counts_.paid_bytes += price;
        ++sequence_;
        ++counts_.offered;
        offer(now, std::move(datagram), out);
        advance();
    }
    if (done_) impairment_.flush(out);
    counts_.dropped = left_empty_ + impairment_.counts().dropped;
    counts_.duplicated = impairment_.counts().duplicated;
}

Time Session::next_wakeup() const {
    return bucket_ ? bucket_->ready_at() : Time::min();
}

std::optional<std::uint64_t> Session::datagrams_in_all() const {
    if (plans_.front().rounds() == 0) return std::nullopt;
    std::uint64_t in_a_round = 0;
    for (const RoundPlan& plan : plans_) in_a_round += plan.datagrams();
    return in_a_round * plans_.front().rounds();
}

void Session::offer(Time now, Datagram datagram, std::vector<Datagram>& out) {
    const common::ImpairmentOptions& loss = options_.impairment;
    if (loss.drop_ellipsoids > 0 || loss.drop_vertices > 0) {
        const auto keep = [&](const protocol::SectionView& section) {
            if (section.kind == protocol::SectionKind::ellipsoids) {
                return !lost_ellipsoids_.next_is_lost();
            }
            if (section.kind == protocol::SectionKind::vertices) {
                return !lost_vertices_.next_is_lost();
            }
            return true;
        };
        std::optional<Datagram> rest = protocol::keep_sections(datagram, keep);
        if (!rest) {
            ++left_empty_;
            return;
        }
        datagram = *std::move(rest);
    }
    if (security_) {
        const auto elapsed = std::chrono::duration_cast<std::chrono::microseconds>(now - *start_);
        datagram = security_->secure(datagram, static_cast<std::uint64_t>(elapsed.count()));
    }
    if (loss.any()) {
        impairment_.offer(std::move(datagram), out);
    } else {
        out.push_back(std::move(datagram));
    }
}

void Session::advance() {
    if (++ordinal_ < plans_[plan_].datagrams()) return;
    ordinal_ = 0;
    if (++plan_ == plans_.size()) {
        plan_ = 0;
        ++counts_.rounds;
        ++round_;
        done_ = finishing_ || (plans_.front().rounds() != 0 && round_ == plans_.front().rounds());
    }
    if (!done_) begin_turn();
}

}  // namespace ellicast::sender
