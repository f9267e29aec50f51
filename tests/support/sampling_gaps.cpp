// tests/support/sampling_gaps.cpp: samples sorted into cubes, which are searched shell by shell.
#include "tests/support/sampling_gaps.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

namespace ellicast::tests {
namespace {

using Eigen::Vector3d;
using Cell = std::array<int, 3>;

class Cubes {
  public:
    Cubes(const Eigen::AlignedBox3d& box, std::span<const Vector3d> samples) : low_(box.min()) {
        // About one sample in a cube that the surface meets.
        const double diagonal = std::max(box.diagonal().norm(), 1e-300);
        width_ = diagonal / std::sqrt(static_cast<double>(samples.size()) + 1.0);
        for (const Vector3d& sample : samples) cubes_[key(cell_of(sample))].push_back(sample);
        reach_ = static_cast<int>(std::ceil(diagonal / width_)) + 1;
    }

    /// The samples are in the box, and so is `p`.
    [[nodiscard]] double nearest(const Vector3d& p) const {
        const Cell home = cell_of(p);
        double best = std::numeric_limits<double>::infinity();
        // Shell k is at least k - 1 cubes away.
        for (int k = 0; k <= reach_ && (k - 1) * width_ < best; ++k) {
            best = std::min(best, nearest_in_shell(p, home, k));
        }
        return best;
    }

  private:
    [[nodiscard]] Cell cell_of(const Vector3d& p) const {
        const Vector3d at = (p - low_) / width_;
        return {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y())),
                static_cast<int>(std::floor(at.z()))};
    }
    static std::int64_t key(const Cell& c) {
        constexpr std::int64_t kSide = 1 << 20;
        return (static_cast<std::int64_t>(c[0]) * kSide + c[1]) * kSide + c[2];
    }
    [[nodiscard]] double nearest_in_cube(const Vector3d& p, const Cell& c) const {
        double best = std::numeric_limits<double>::infinity();
        const auto cube = cubes_.find(key(c));
        if (cube == cubes_.end()) return best;
        for (const Vector3d& sample : cube->second) best = std::min(best, (sample - p).norm());
        return best;
    }
    [[nodiscard]] double nearest_in_shell(const Vector3d& p, const Cell& home, int k) const {
        double best = std::numeric_limits<double>::infinity();
        for (int x = -k; x <= k; ++x) {
            for (int y = -k; y <= k; ++y) {
                const bool whole = std::abs(x) == k || std::abs(y) == k;
                const int step = whole || k == 0 ? 1 : 2 * k;
                for (int z = -k; z <= k; z += step) {
                    best =
                        std::min(best, nearest_in_cube(p, {home[0] + x, home[1] + y, home[2] + z}));
                }
            }
        }
        return best;
    }

    Vector3d low_;
    double width_ = 0;
    int reach_ = 0;
    std::unordered_map<std::int64_t, std::vector<Vector3d>> cubes_;
};

}  // namespace

SamplingGaps sampling_gaps(std::span<const Vector3d> points, std::span<const Vector3d> samples) {
    assert(!points.empty() && !samples.empty());
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : points) box.extend(p);
    for (const Vector3d& p : samples) box.extend(p);
    const Cubes cubes(box, samples);
    std::vector<double> distances;
    distances.reserve(points.size());
    for (const Vector3d& p : points) distances.push_back(cubes.nearest(p));
    const auto rank =
        distances.begin() + static_cast<std::ptrdiff_t>(99 * (distances.size() - 1) / 100);
    std::nth_element(distances.begin(), rank, distances.end());
    return {*rank, *std::max_element(rank, distances.end())};
}

}  // namespace ellicast::tests
