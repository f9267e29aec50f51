// common/loss_model.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/random.hpp"

namespace ellicast::common {

/// Independent loss with one probability.
struct BernoulliLoss {
    double p = 0.0;
};

/// Gilbert-Elliott chain ([G60], [E63]): state good or bad, one step per datagram. Starts in the
/// stationary distribution, by the seed.
struct GilbertLoss {
    double good_to_bad = 0.0;
    double bad_to_good = 1.0;
    double loss_bad = 1.0;   // loss probability in the bad state
    double loss_good = 0.0;  // loss probability in the good state
};

/// A recorded pattern, repeated when it ends: true = lost. Not empty.
struct TraceLoss {
    std::vector<bool> lost;
};

using LossProcess = std::variant<BernoulliLoss, GilbertLoss, TraceLoss>;

/// Parses "bernoulli:P", "gilbert:p,r[,lb[,lg]]" or "trace:FILE"'s FILE content apart: see
/// parse_trace. Throws std::invalid_argument with a one-line reason that quotes the text.
/// Probabilities lie in [0, 1]. "trace:" is not accepted here because it needs a file; the caller
/// reads it and uses parse_trace.
LossProcess parse_loss(std::string_view text);

/// A trace is a sequence of '0' (arrived) and '1' (lost); white space and lines from '#' are
/// skipped. Throws std::invalid_argument for anything else, or when nothing remains.
TraceLoss parse_trace(std::string_view content);

/// What one seed drives, each from a stream of numbers of its own. Protocol-aware callers take the
/// last two for --drop-ellipsoids and --drop-vertices.
enum class LossStream : std::uint8_t {
    drop,
    loss,
    reorder,
    duplicate,
    corrupt,
    ellipsoids,
    vertices
};

/// The seed of one of the streams that belong to `seed`; streams share no stretch of numbers.
std::uint64_t stream_seed(std::uint64_t seed, LossStream stream);

/// A seeded sequence of lost / not lost. Same process, same seed: same sequence on every platform.
class LossSequence {
  public:
    /// Requires probabilities in [0, 1] and a trace that is not empty (asserted).
    LossSequence(LossProcess process, std::uint64_t seed);
    bool next_is_lost();

  private:
    LossProcess process_;
    Random random_;
    bool bad_ = false;
    std::size_t position_ = 0;
};

/// What the impairment options of both programs say. Every probability is per datagram, except
/// those of ellipsoids and vertices, which act on sections of that kind (protocol-aware callers
/// apply them with LossSequence themselves).
struct ImpairmentOptions {
    double drop = 0.0;                // all datagrams, independent
    double drop_ellipsoids = 0.0;     // sections of ellipsoids
    double drop_vertices = 0.0;       // sections of vertices
    std::optional<LossProcess> loss;  // in addition to drop
    double reorder = 0.0;             // held back behind 1 to 8 later datagrams
    double duplicate = 0.0;           // delivered twice
    double corrupt = 0.0;             // 1 to 8 random bits flipped, all different
    std::uint64_t seed = 1;

    [[nodiscard]] bool any() const {
        return drop > 0 || drop_ellipsoids > 0 || drop_vertices > 0 || loss || reorder > 0 ||
               duplicate > 0 || corrupt > 0;
    }
};

/// Counts of what an impairment did. Those below `dropped` count only datagrams that were not
/// dropped.
struct ImpairmentCounts {
    std::uint64_t offered = 0;
    std::uint64_t dropped = 0;    // by `drop` or by `loss`
    std::uint64_t reordered = 0;  // held back
    std::uint64_t duplicated = 0;
    std::uint64_t corrupted = 0;
};

/// A seeded, clockless network: datagrams go in, those that survive come out, perhaps later, twice
/// or damaged. Same seed, same input: same output. Each kind of damage draws from its own seeded
/// stream, and the same amount for every datagram offered, lost or not, so that switching one on
/// does not change what the others do to a datagram. Damaged first, then doubled; both copies are
/// held back together.
class Impairment {
  public:
    explicit Impairment(const ImpairmentOptions& options);

    /// Offers one datagram; appends to `out` what is delivered now (none, one or more): itself
    /// first, then those whose time behind it has come, longest due first.
    void offer(std::vector<std::uint8_t> datagram, std::vector<std::vector<std::uint8_t>>& out);
    /// Delivers what reordering still holds back.
    void flush(std::vector<std::vector<std::uint8_t>>& out);

    [[nodiscard]] const ImpairmentCounts& counts() const { return counts_; }

  private:
    struct Fate {
        bool dropped = false;
        bool duplicated = false;
        std::uint64_t held_for = 0;      // later datagrams; 0 = not held
        std::uint64_t corrupt_seed = 0;  // 0 = intact
    };
    struct Held {
        std::uint64_t release_at = 0;  // value of counts_.offered
        std::vector<std::uint8_t> bytes;
    };
    Fate draw_fate();
    void deliver(std::vector<std::uint8_t> datagram, std::uint64_t held_for,
                 std::vector<std::vector<std::uint8_t>>& out);
    void release(std::uint64_t until, std::vector<std::vector<std::uint8_t>>& out);

    ImpairmentOptions options_;
    LossSequence drop_;
    std::optional<LossSequence> loss_;
    Random reorder_;
    Random duplicate_;
    Random corrupt_;
    std::deque<Held> held_;  // by release_at, ties in order of arrival
    ImpairmentCounts counts_;
};

}  // namespace ellicast::common
