// common/loss_model.cpp
#include "common/loss_model.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <utility>

namespace ellicast::common {
namespace {

constexpr std::size_t kMaxHeldFor = 8;  // later datagrams that overtake one held back
constexpr std::size_t kMaxFlips = 8;    // bits

[[maybe_unused]] bool is_probability(double p) {
    return p >= 0.0 && p <= 1.0;
}  // false for NaN

[[maybe_unused]] bool is_valid(const BernoulliLoss& loss) {
    return is_probability(loss.p);
}
[[maybe_unused]] bool is_valid(const GilbertLoss& loss) {
    return is_probability(loss.good_to_bad) && is_probability(loss.bad_to_good) &&
           is_probability(loss.loss_bad) && is_probability(loss.loss_good);
}
[[maybe_unused]] bool is_valid(const TraceLoss& loss) {
    return !loss.lost.empty();
}

/// Flips 1 to kMaxFlips bits, all different; fewer when there are fewer.
void flip_bits(std::vector<std::uint8_t>& bytes, Random random) {
    const std::size_t bits = 8 * bytes.size();
    if (bits == 0) return;
    const std::size_t wanted = std::min(1 + random.below(kMaxFlips), bits);
    std::array<std::size_t, kMaxFlips> flipped{};
    for (std::size_t count = 0; count < wanted;) {
        const std::size_t bit = random.below(bits);
        const auto end = flipped.begin() + static_cast<std::ptrdiff_t>(count);
        if (std::find(flipped.begin(), end, bit) != end) continue;
        flipped[count++] = bit;
        bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
    }
}

}  // namespace

std::uint64_t stream_seed(std::uint64_t seed, LossStream stream) {
    // SplitMix64 walks one cycle of 2^64 states; a hash of seed and stream sets them far apart on
    // it.
    const std::uint64_t hashed = Random(seed).next();
    return Random(hashed ^ ((static_cast<std::uint64_t>(stream) + 1) << 56)).next();
}

LossSequence::LossSequence(LossProcess process, std::uint64_t seed)
    : process_(std::move(process)), random_(seed) {
    assert(std::visit([](const auto& loss) { return is_valid(loss); }, process_));
    if (const auto* gilbert = std::get_if<GilbertLoss>(&process_)) {
        // Stationary share of the bad state: p / (p + r). A chain that never moves is good for
        // ever.
        const double moves = gilbert->good_to_bad + gilbert->bad_to_good;
        bad_ = moves > 0.0 && random_.chance(gilbert->good_to_bad / moves);
    }
}

bool LossSequence::next_is_lost() {
    if (const auto* bernoulli = std::get_if<BernoulliLoss>(&process_)) {
        return random_.chance(bernoulli->p);
    }
    if (const auto* gilbert = std::get_if<GilbertLoss>(&process_)) {
        const bool lost = random_.chance(bad_ ? gilbert->loss_bad : gilbert->loss_good);
        if (random_.chance(bad_ ? gilbert->bad_to_good : gilbert->good_to_bad)) bad_ = !bad_;
        return lost;
    }
    const auto& trace = std::get<TraceLoss>(process_).lost;
    const bool lost = trace[position_];
    position_ = (position_ + 1) % trace.size();
    return lost;
}

Impairment::Impairment(const ImpairmentOptions& options)
    : options_(options),
      drop_(BernoulliLoss{options.drop}, stream_seed(options.seed, LossStream::drop)),
      reorder_(stream_seed(options.seed, LossStream::reorder)),
      duplicate_(stream_seed(options.seed, LossStream::duplicate)),
      corrupt_(stream_seed(options.seed, LossStream::corrupt)) {
    if (options.loss) loss_.emplace(*options.loss, stream_seed(options.seed, LossStream::loss));
}

/// Draws the same amount from each stream whatever comes out, so that none depends on another.
Impairment::Fate Impairment::draw_fate() {
    Fate fate;
    fate.dropped = drop_.next_is_lost();
    if (loss_ && loss_->next_is_lost()) fate.dropped = true;
    const bool held = reorder_.chance(options_.reorder);
    const std::size_t held_for = 1 + reorder_.below(kMaxHeldFor);
    fate.held_for = held ? held_for : 0;
    fate.duplicated = duplicate_.chance(options_.duplicate);
    const bool corrupted = corrupt_.chance(options_.corrupt);
    const std::uint64_t corrupt_seed = corrupt_.next() | 1u;
    fate.corrupt_seed = corrupted ? corrupt_seed : 0;
    return fate;
}

void Impairment::offer(std::vector<std::uint8_t> datagram,
                       std::vector<std::vector<std::uint8_t>>& out) {
    ++counts_.offered;
    const Fate fate = draw_fate();
    if (fate.dropped) {
        ++counts_.dropped;
    } else {
        if (fate.corrupt_seed != 0) {
            ++counts_.corrupted;
            flip_bits(datagram, Random(fate.corrupt_seed));
        }
        if (fate.duplicated) {
            ++counts_.duplicated;
            deliver(datagram, fate.held_for, out);
        }
        if (fate.held_for > 0) ++counts_.reordered;
        deliver(std::move(datagram), fate.held_for, out);
    }
    release(counts_.offered, out);
}

void Impairment::flush(std::vector<std::vector<std::uint8_t>>& out) {
    release(std::numeric_limits<std::uint64_t>::max(), out);
}

void Impairment::deliver(std::vector<std::uint8_t> datagram, std::uint64_t held_for,
                         std::vector<std::vector<std::uint8_t>>& out) {
    if (held_for == 0) {
        out.push_back(std::move(datagram));
        return;
    }
    const std::uint64_t release_at = counts_.offered + held_for;
    const auto later = [](std::uint64_t at, const Held& held) { return at < held.release_at; };
    const auto place = std::upper_bound(held_.begin(), held_.end(), release_at, later);
    held_.insert(place, Held{release_at, std::move(datagram)});
}

void Impairment::release(std::uint64_t until, std::vector<std::vector<std::uint8_t>>& out) {
    while (!held_.empty() && held_.front().release_at <= until) {
        out.push_back(std::move(held_.front().bytes));
        held_.pop_front();
    }
}

}  // namespace ellicast::common
