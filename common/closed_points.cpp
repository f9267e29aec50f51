// common/closed_points.cpp
#include "common/closed_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace ellicast::common {
namespace {

constexpr float kFar = 1e9F;  // more than any squared distance in nodes, and still exact enough

// Lower envelope of parabolas: value[i] becomes the least of (i - j)^2 + value[j] over all j.
class LineDistance {
  public:
    explicit LineDistance(std::size_t length) : old_(length), apex_(length), from_(length + 1) {}

    void operator()(float* value, std::size_t stride, std::size_t length) {
        for (std::size_t i = 0; i < length; ++i) old_[i] = value[i * stride];
        std::size_t k = 0;
        apex_[0] = 0;
        from_[0] = -std::numeric_limits<double>::infinity();
        for (std::size_t i = 1; i < length; ++i) {
            double meet = meeting(apex_[k], i);
            while (meet <= from_[k]) meet = meeting(apex_[--k], i);
            apex_[++k] = i;
            from_[k] = meet;
        }
        const std::size_t last = k;
        k = 0;
        for (std::size_t i = 0; i < length; ++i) {
            const auto at = static_cast<double>(i);
            while (k < last && from_[k + 1] < at) ++k;
            const double d = at - static_cast<double>(apex_[k]);
            value[i * stride] = static_cast<float>(d * d + old_[apex_[k]]);
        }
    }

  private:
    // Where the parabola of b > a falls below that of a.
    [[nodiscard]] double meeting(std::size_t a, std::size_t b) const {
        const auto x = static_cast<double>(a);
        const auto y = static_cast<double>(b);
        return 0.5 * ((old_[b] + y * y) - (old_[a] + x * x)) / (y - x);
    }

    std::vector<double> old_;
    std::vector<std::size_t> apex_;
    std::vector<double> from_;
};

// Squared distance in nodes to the nearest node whose value is 0; the others must be kFar.
void squared_distances(const GridFrame& frame, std::vector<float>& values) {
    const std::array<std::size_t, 3> n = {static_cast<std::size_t>(frame.dims[0]),
                                          static_cast<std::size_t>(frame.dims[1]),
                                          static_cast<std::size_t>(frame.dims[2])};
    const std::array<std::size_t, 3> stride = {1, n[0], n[0] * n[1]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t u = (axis + 1) % 3;
        const std::size_t v = (axis + 2) % 3;
        LineDistance line(n[axis]);
        for (std::size_t j = 0; j < n[v]; ++j) {
            for (std::size_t i = 0; i < n[u]; ++i) {
                line(values.data() + i * stride[u] + j * stride[v], stride[axis], n[axis]);
            }
        }
    }
}

// Nodes reached from the border through free ones, by faces.
std::vector<bool> reached_from_border(const GridFrame& frame, const std::vector<bool>& free) {
    std::vector<bool> reached(free.size(), false);
    std::vector<std::array<int, 3>> open;
    const auto visit = [&](const std::array<int, 3>& n, bool border) {
        const std::size_t i = frame.index(n[0], n[1], n[2]);
        if (reached[i] || !(free[i] || border)) return;
        reached[i] = true;
        open.push_back(n);
    };
    for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
            const bool inner = k > 0 && k + 1 < frame.dims[2] && j > 0 && j + 1 < frame.dims[1];
            const int step = inner ? std::max(1, frame.dims[0] - 1) : 1;
            for (int i = 0; i < frame.dims[0]; i += step) visit({i, j, k}, true);
        }
    }
    while (!open.empty()) {
        const std::array<int, 3> n = open.back();
        open.pop_back();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const int side : {-1, 1}) {
                std::array<int, 3> m = n;
                m[axis] += side;
                if (m[axis] >= 0 && m[axis] < frame.dims[axis]) visit(m, false);
            }
        }
    }
    return reached;
}

}  // namespace

DistanceGrid closed_points(const DistanceGrid& grid, std::span<const Eigen::Vector3d> points,
                           double radius) {
    const GridFrame& frame = grid.frame;
    DistanceGrid result = grid;
    std::vector<float>& values = result.values;
    for (float& v : values) v = v < 0.0F ? 0.0F : kFar;
    for (const Eigen::Vector3d& p : points) {
        const Eigen::Vector3d at = (p - frame.origin) / frame.spacing;
        std::array<int, 3> n{};
        for (std::size_t a = 0; a < 3; ++a) {
            const double limit = static_cast<double>(frame.dims[a] - 1);
            n[a] = static_cast<int>(
                std::lround(std::clamp(at[static_cast<Eigen::Index>(a)], 0.0, limit)));
        }
        values[frame.index(n[0], n[1], n[2])] = 0.0F;
    }
    squared_distances(frame, values);
    const double cells = radius / frame.spacing;
    std::vector<bool> free(values.size());
    for (std::size_t i = 0; i < free.size(); ++i) free[i] = values[i] > cells * cells;
    const std::vector<bool> outside = reached_from_border(frame, free);
    for (std::size_t i = 0; i < free.size(); ++i) values[i] = outside[i] ? 0.0F : kFar;
    squared_distances(frame, values);
    for (float& v : values) {
        const double depth = std::sqrt(static_cast<double>(v)) * frame.spacing;
        v = static_cast<float>(
            std::clamp(radius - depth, -double{grid.outside}, double{grid.outside}));
    }
    return result;
}

}  // namespace ellicast::common
