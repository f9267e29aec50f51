// common/normal_band.cpp
#include "common/normal_band.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// In spacings.
constexpr double kReach = 2.5;
constexpr double kWholly = 0.75;  // nearer than this only the planes count
constexpr double kNotAtAll = 1.75;
constexpr double kSoftening = 0.25;

struct Opinion {
    double sum = 0.0;
    double weight = 0.0;
    double nearest = std::numeric_limits<double>::infinity();  // squared
};

void add_point(const Vector3d& p, const Vector3d& n, double spacing, const GridFrame& frame,
               std::vector<Opinion>& opinions) {
    const double reach = kReach * spacing;
    const double soft = kSoftening * kSoftening * spacing * spacing;
    std::array<int, 3> lo{};
    std::array<int, 3> hi{};
    for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<Eigen::Index>(a);
        const double limit = static_cast<double>(frame.dims[a] - 1);
        const auto node = [&](double x) {
            return std::clamp((x - frame.origin[axis]) / frame.spacing, 0.0, limit);
        };
        lo[a] = static_cast<int>(std::ceil(node(p[axis] - reach)));
        hi[a] = static_cast<int>(std::floor(node(p[axis] + reach)));
    }
    for (int k = lo[2]; k <= hi[2]; ++k) {
        for (int j = lo[1]; j <= hi[1]; ++j) {
            for (int i = lo[0]; i <= hi[0]; ++i) {
                const Vector3d d = frame.position(i, j, k) - p;
                const double squared = d.squaredNorm();
                if (squared >= reach * reach) continue;
                const double fade = 1.0 - squared / (reach * reach);
                const double w =
                    fade * fade * (soft * soft) / ((squared + soft) * (squared + soft));
                Opinion& opinion = opinions[frame.index(i, j, k)];
                opinion.sum += w * n.dot(d);
                opinion.weight += w;
                opinion.nearest = std::min(opinion.nearest, squared);
            }
        }
    }
}

}  // namespace

NormalBand::NormalBand(std::span<const Vector3d> points, std::span<const Vector3d> normals,
                       double spacing, const GridFrame& frame)
    : value_(frame.size(), 0.0F), share_(frame.size(), 0.0F) {
    assert(points.size() == normals.size());
    std::vector<Opinion> opinions(frame.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
        add_point(points[p], normals[p], spacing, frame, opinions);
    }
    for (std::size_t i = 0; i < opinions.size(); ++i) {
        const Opinion& opinion = opinions[i];
        if (!(opinion.weight > 0.0)) continue;
        const double d = std::sqrt(opinion.nearest) / spacing;
        const double t = std::clamp((d - kWholly) / (kNotAtAll - kWholly), 0.0, 1.0);
        share_[i] = static_cast<float>(1.0 - t * t * (3.0 - 2.0 * t));
        value_[i] = static_cast<float>(opinion.sum / opinion.weight);
    }
}

void NormalBand::blend_into(DistanceGrid& grid) const {
    assert(grid.values.size() == value_.size());
    for (std::size_t i = 0; i < value_.size(); ++i) {
        const float plane = std::clamp(value_[i], -grid.outside, grid.outside);
        grid.values[i] += share_[i] * (plane - grid.values[i]);
    }
}

}  // namespace ellicast::common
