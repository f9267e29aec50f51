// tests/receiver/loss_runs_test.cpp
#include "receiver/loss_runs.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "common/random.hpp"

using ellicast::common::Random;
using ellicast::receiver::LossPattern;
using ellicast::receiver::LossRuns;

namespace {

/// Of a text of '.' received and 'x' lost, by the definitions, with no thought of speed.
LossPattern plain(const std::string& fates) {
    LossPattern pattern;
    const auto count = [&](std::size_t begin, std::size_t end, char fate) {
        std::uint64_t n = 0;
        for (std::size_t k = begin; k < end; ++k) n += fates[k] == fate;
        return n;
    };
    for (std::size_t k = 0; k < fates.size(); ++k) {
        if (fates[k] != 'x' || (k > 0 && fates[k - 1] == 'x')) continue;
        std::size_t end = k;
        while (end < fates.size() && fates[end] == 'x') ++end;
        ++pattern.runs;
        pattern.longest_run = std::max<std::uint64_t>(pattern.longest_run, end - k);
    }
    // Longest stretches from loss to loss without kGmin received in a row.
    std::size_t gap_begin = 0;
    const auto add_gap = [&](std::size_t end) {
        if (end == gap_begin) return;
        ++pattern.gaps;
        pattern.gap_lost += count(gap_begin, end, 'x');
        pattern.gap_received += count(gap_begin, end, '.');
    };
    for (std::size_t k = 0; k < fates.size(); ++k) {
        if (fates[k] != 'x') continue;
        std::size_t last = k;
        for (std::size_t next = k + 1; next < fates.size(); ++next) {
            if (next - last > LossPattern::kGmin) break;
            if (fates[next] == 'x') last = next;
        }
        if (count(k, last + 1, 'x') > 1) {
            add_gap(k);
            ++pattern.bursts;
            pattern.burst_lost += count(k, last + 1, 'x');
            pattern.burst_received += count(k, last + 1, '.');
            gap_begin = last + 1;
        }
        k = last;
    }
    add_gap(fates.size());
    return pattern;
}

LossPattern fed(const std::string& fates, bool together = false) {
    LossRuns runs;
    for (std::size_t k = 0; k < fates.size(); ++k) {
        if (fates[k] == '.') {
            runs.add_received();
            continue;
        }
        std::size_t end = k + 1;
        while (together && end < fates.size() && fates[end] == 'x') ++end;
        runs.add_lost(end - k);
        k = end - 1;
    }
    return runs.pattern();
}

}  // namespace

TEST_CASE("without losses all is one gap, and of nothing there is nothing") {
    CHECK(LossRuns().pattern() == LossPattern{});
    const LossPattern pattern = fed(std::string(100, '.'));
    CHECK(pattern.gaps == 1);
    CHECK(pattern.gap_received == 100);
    CHECK(pattern.bursts == 0);
    CHECK(pattern.mean_run() == 0.0);
    CHECK(pattern.burst_density() == 0.0);
}

TEST_CASE("losses with 15 received between are one burst, with 16 two isolated ones") {
    const std::string head(20, '.');
    const LossPattern near = fed(head + "x" + std::string(15, '.') + "x" + head);
    CHECK(near.bursts == 1);
    CHECK(near.mean_burst() == 17.0);
    CHECK(near.burst_density() == Approx(2.0 / 17.0));
    CHECK(near.gap_lost == 0);
    CHECK(near.gaps == 2);
    CHECK(near.runs == 2);
    const LossPattern far = fed(head + "x" + std::string(16, '.') + "x" + head);
    CHECK(far.bursts == 0);
    CHECK(far.gap_lost == 2);
    CHECK(far.gaps == 1);
    CHECK(far.gap_density() == Approx(2.0 / 58.0));
}

TEST_CASE("patterns are those that the definitions give, whatever the losses") {
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        CAPTURE(seed);
        Random random(seed);
        const double into = random.uniform() * random.uniform();
        const double out = random.uniform();
        std::string fates;
        bool bad = false;
        const std::size_t length = random.below(400);
        while (fates.size() < length) {
            bad = random.chance(bad ? 1.0 - out : into);
            fates += bad ? 'x' : '.';
        }
        CAPTURE(fates);
        REQUIRE(fed(fates) == plain(fates));
        REQUIRE(fed(fates, true) == plain(fates));
    }
}

TEST_CASE("patterns of several streams add up") {
    LossPattern sum = fed("..xx..x");
    sum += fed("xxxx");
    CHECK(sum.lost() == 7);
    CHECK(sum.runs == 3);
    CHECK(sum.longest_run == 4);
    CHECK(sum.mean_run() == Approx(7.0 / 3.0));
    CHECK(sum.bursts == 2);
}
