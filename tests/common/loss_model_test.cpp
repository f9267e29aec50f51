// tests/common/loss_model_test.cpp: loss processes and impairments against closed forms. Tolerances
// are given in standard deviations of the estimate; all seeds are fixed.
#include "common/loss_model.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

namespace {

using namespace ellicast::common;
using Bytes = std::vector<std::uint8_t>;

constexpr double kSigmas = 4.5;  // 7 in a million by chance, and the seeds are fixed

std::vector<bool> draw(const LossProcess& process, std::uint64_t seed, std::size_t count) {
    LossSequence sequence(process, seed);
    std::vector<bool> lost(count);
    for (std::size_t k = 0; k < count; ++k) lost[k] = sequence.next_is_lost();
    return lost;
}

double mean(const std::vector<bool>& lost) {
    return static_cast<double>(std::count(lost.begin(), lost.end(), true)) /
           static_cast<double>(lost.size());
}

/// Correlation of the sequence with itself `lag` later, or of two sequences (lag 0).
double correlation(const std::vector<bool>& a, const std::vector<bool>& b, std::size_t lag) {
    const double mean_a = mean(a);
    const double mean_b = mean(b);
    double sum = 0.0;
    const std::size_t count = a.size() - lag;
    for (std::size_t k = 0; k < count; ++k) {
        sum += ((a[k] ? 1.0 : 0.0) - mean_a) * ((b[k + lag] ? 1.0 : 0.0) - mean_b);
    }
    const double variance = std::sqrt(mean_a * (1 - mean_a) * mean_b * (1 - mean_b));
    return sum / static_cast<double>(count) / variance;
}

/// Lengths of the runs of lost datagrams, the last one left out.
std::vector<std::size_t> bursts(const std::vector<bool>& lost) {
    std::vector<std::size_t> lengths;
    std::size_t run = 0;
    for (const bool one : lost) {
        if (one) ++run;
        if (!one && run > 0) lengths.push_back(std::exchange(run, 0));
    }
    return lengths;
}

}  // namespace

TEST_CASE("independent loss has its rate and no memory") {
    constexpr std::size_t kCount = 200'000;
    for (const double p : {0.01, 0.3, 0.5, 0.9}) {
        CAPTURE(p);
        const auto lost = draw(BernoulliLoss{p}, 1, kCount);
        CHECK(std::abs(mean(lost) - p) < kSigmas * std::sqrt(p * (1 - p) / kCount));
        for (const std::size_t lag : {1u, 2u, 7u}) {
            CHECK(std::abs(correlation(lost, lost, lag)) < kSigmas / std::sqrt(kCount));
        }
    }
}

TEST_CASE("probabilities 0 and 1 mean never and always") {
    CHECK(mean(draw(BernoulliLoss{0.0}, 1, 10'000)) == 0.0);
    CHECK(mean(draw(BernoulliLoss{1.0}, 1, 10'000)) == 1.0);
    CHECK(mean(draw(GilbertLoss{0.5, 0.5, 0.0, 0.0}, 1, 10'000)) == 0.0);
    CHECK(mean(draw(GilbertLoss{0.5, 0.5, 1.0, 1.0}, 1, 10'000)) == 1.0);
    CHECK(mean(draw(GilbertLoss{0.0, 1.0, 1.0, 0.0}, 1, 10'000)) == 0.0);  // never bad
    CHECK(mean(draw(GilbertLoss{1.0, 0.0, 1.0, 0.0}, 1, 10'000)) == 1.0);  // never good
    CHECK(mean(draw(GilbertLoss{0.0, 0.0, 1.0, 0.0}, 1, 10'000)) == 0.0);  // starts good, stays
}

TEST_CASE("a Gilbert-Elliott chain loses at its stationary rate and forgets at its own pace") {
    constexpr std::size_t kCount = 400'000;
    const std::vector<GilbertLoss> chains{
        {0.05, 0.2, 1.0, 0.0}, {0.01, 0.05, 0.8, 0.02}, {0.5, 0.5, 1.0, 0.0}, {0.9, 0.8, 0.7, 0.1}};
    for (const GilbertLoss& chain : chains) {
        CAPTURE(chain.good_to_bad, chain.bad_to_good);
        const auto lost = draw(chain, 2, kCount);
        const double bad = chain.good_to_bad / (chain.good_to_bad + chain.bad_to_good);
        const double rate = bad * chain.loss_bad + (1 - bad) * chain.loss_good;
        // Covariance at lag k: bad (1 - bad) (lb - lg)^2 m^k, m the chain's second eigenvalue.
        const double m = 1 - chain.good_to_bad - chain.bad_to_good;
        const double spread = chain.loss_bad - chain.loss_good;
        const double memory = bad * (1 - bad) * spread * spread;
        const double variance = rate * (1 - rate) + 2 * memory * m / (1 - m);
        CHECK(std::abs(mean(lost) - rate) < kSigmas * std::sqrt(variance / kCount));
        // The estimate's own deviation grows with the memory: (1 + m) / (1 - m) at most.
        const double tolerance =
            kSigmas * std::sqrt((1 + std::abs(m)) / (1 - std::abs(m)) / kCount);
        for (const std::size_t lag : {1u, 2u, 5u}) {
            const double expected =
                memory * std::pow(m, static_cast<double>(lag)) / (rate * (1 - rate));
            CHECK(std::abs(correlation(lost, lost, lag) - expected) < tolerance);
        }
    }
}

TEST_CASE("bursts of a simple Gilbert chain are geometric with mean 1 / r") {
    constexpr double kLeave = 0.05;  // mean burst 20
    const auto lengths = bursts(draw(GilbertLoss{0.0125, kLeave, 1.0, 0.0}, 3, 2'000'000));
    const auto count = static_cast<double>(lengths.size());
    REQUIRE(count > 15'000);
    const double mean_length =
        static_cast<double>(std::accumulate(lengths.begin(), lengths.end(), std::size_t{0})) /
        count;
    const double deviation = std::sqrt(1 - kLeave) / kLeave;
    CHECK(std::abs(mean_length - 1 / kLeave) < kSigmas * deviation / std::sqrt(count));
    for (const std::size_t longer : {1u, 5u, 20u, 60u}) {
        const double expected = std::pow(1 - kLeave, static_cast<double>(longer));
        const auto seen = static_cast<double>(std::count_if(
            lengths.begin(), lengths.end(), [&](std::size_t n) { return n > longer; }));
        CHECK(std::abs(seen / count - expected) <
              kSigmas * std::sqrt(expected * (1 - expected) / count));
    }
}

TEST_CASE("a Gilbert chain starts in its stationary state, over the seeds") {
    constexpr std::size_t kSeeds = 20'000;
    std::size_t lost = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        LossSequence sequence(GilbertLoss{0.01, 0.03, 1.0, 0.0}, seed);
        lost += sequence.next_is_lost() ? 1 : 0;
    }
    const double share = static_cast<double>(lost) / kSeeds;
    CHECK(std::abs(share - 0.25) < kSigmas * std::sqrt(0.25 * 0.75 / kSeeds));
}

TEST_CASE("a trace is followed and begins again at its end") {
    const auto lost = draw(TraceLoss{{true, false, false}}, 9, 8);
    CHECK(lost == std::vector<bool>{true, false, false, true, false, false, true, false});
}

TEST_CASE("a seed gives one sequence on every platform") {  // worked out apart from the code
    const auto text = [](const std::vector<bool>& lost) {
        std::string out;
        for (const bool one : lost) out += one ? '1' : '0';
        return out;
    };
    CHECK(text(draw(BernoulliLoss{0.3}, 1, 40)) == "0000000010000001000011011100100000100000");
    CHECK(text(draw(GilbertLoss{0.1, 0.3, 0.9, 0.05}, 1, 40)) ==
          "0000000000111001100000000000000001100000");
    CHECK(stream_seed(1, LossStream::drop) == 0xfccd77c0d6f9a3dau);
}

TEST_CASE("sequences of neighbouring seeds and of other streams have nothing in common") {
    constexpr std::size_t kCount = 20'000;
    std::vector<std::vector<bool>> all;
    for (const std::uint64_t seed : {0u, 1u, 2u}) {
        for (int stream = 0; stream < 7; ++stream) {
            const auto own = stream_seed(seed, static_cast<LossStream>(stream));
            all.push_back(draw(BernoulliLoss{0.5}, own, kCount));
        }
    }
    for (std::size_t a = 0; a < all.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
            CAPTURE(a, b);
            for (const std::size_t lag : {0u, 1u, 2u}) {
                REQUIRE(std::abs(correlation(all[a], all[b], lag)) < 5.0 / std::sqrt(kCount));
                REQUIRE(std::abs(correlation(all[b], all[a], lag)) < 5.0 / std::sqrt(kCount));
            }
        }
    }
}
