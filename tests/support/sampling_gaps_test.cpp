// tests/support/sampling_gaps_test.cpp
#include "tests/support/sampling_gaps.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <vector>

#include "common/random.hpp"

using namespace ellicast;
using Eigen::Vector3d;

namespace {

std::vector<Vector3d> points_at_random(std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<Vector3d> points;
    for (std::size_t k = 0; k < count; ++k) {
        const double x = static_cast<double>(random.below(1'000'000)) / 1e6;
        const double y = static_cast<double>(random.below(1'000'000)) / 1e6;
        points.emplace_back(3 * x - 1, y, x * y);
    }
    return points;
}

}  // namespace

TEST_CASE("gaps are those that a look at all pairs finds") {
    const std::vector<Vector3d> points = points_at_random(500, 1);
    const std::vector<Vector3d> samples = points_at_random(GENERATE(1, 7, 300), 2);
    std::vector<double> distances;
    for (const Vector3d& p : points) {
        double best = std::numeric_limits<double>::infinity();
        for (const Vector3d& sample : samples) best = std::min(best, (sample - p).norm());
        distances.push_back(best);
    }
    std::sort(distances.begin(), distances.end());
    const tests::SamplingGaps gaps = tests::sampling_gaps(points, samples);
    CHECK(gaps.largest == distances.back());
    CHECK(gaps.percentile_99 == distances[494]);
}

TEST_CASE("who was sampled himself is at no distance, one who was not is at his neighbour's") {
    std::vector<Vector3d> points;
    for (int k = 0; k < 100; ++k) points.emplace_back(k, 0, 0);
    CHECK(tests::sampling_gaps(points, points).largest == 0.0);
    std::vector<Vector3d> samples = points;
    samples.erase(samples.begin() + 40, samples.begin() + 49);  // a hole of nine
    const tests::SamplingGaps gaps = tests::sampling_gaps(points, samples);
    CHECK(gaps.largest == 5.0);
    CHECK(gaps.percentile_99 == 4.0);
}
