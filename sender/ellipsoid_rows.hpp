// sender/ellipsoid_rows.hpp
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "common/ellipsoid.hpp"
#include "common/solid_voxels.hpp"

namespace ellicast::sender {

/// The nodes of one grid row inside an ellipsoid: begin <= i < end at (., j, k), never empty.
struct VoxelRow {
    int j = 0, k = 0;
    int begin = 0, end = 0;
};

/// Half-open ranges of node indices.
struct VoxelBox {
    std::array<int, 3> begin{0, 0, 0};
    std::array<int, 3> end{0, 0, 0};

    [[nodiscard]] bool overlaps(const VoxelBox& other) const {
        for (std::size_t a = 0; a < 3; ++a) {
            if (begin[a] >= other.end[a] || other.begin[a] >= end[a]) return false;
        }
        return true;
    }
};

/// An ellipsoid ready to be rasterised by rows. A node x is inside when d'Ad <= 1, d = x - c,
/// A = (L L')^-1. With i eliminated that is a quadratic in (j, k), with j eliminated one in k, so
/// that layers, rows of a layer and nodes of a row each come from one square root and no node is
/// tested. In float32, because a selection looks at some ten million rows: a node within 1e-3 of a
/// spacing of the surface may fall on either side. Same ellipsoid and frame, same rows.
class EllipsoidRows {
  public:
    EllipsoidRows(const common::Ellipsoid& ellipsoid, const common::GridFrame& frame);

    /// Holds every row.
    [[nodiscard]] const VoxelBox& box() const { return box_; }

    /// Holds the j of every row of layer k: begin and end.
    [[nodiscard]] std::array<int, 2> rows_of_layer(int k) const {
        const float dk = static_cast<float>(k) - center_[2];
        const float rest = 1.0f - kk_ * dk * dk;
        if (rest < 0.0f) return {0, 0};
        const float half_j = std::sqrt(rest * inv_jj_);
        const float mid_j = center_[1] + j_of_k_ * dk;
        const auto rows = static_cast<float>(dims_[1]);
        return {first_from(mid_j - half_j, rows), first_from(mid_j + half_j, rows)};
    }

    /// Calls body(row) for every row of layer k that has nodes inside, in order of j.
    template <class Body>
    void for_each_in_layer(int k, const Body& body) const;

    /// Calls body(row) for every row with first_k <= k < last_k, in order of k, then j.
    template <class Body>
    void for_each(int first_k, int last_k, const Body& body) const {
        const int k_end = std::min(box_.end[2], last_k);
        for (int k = std::max(box_.begin[2], first_k); k < k_end; ++k) for_each_in_layer(k, body);
    }

    template <class Body>
    void for_each(const Body& body) const {
        for_each(box_.begin[2], box_.end[2], body);
    }

  private:
    // Begin or end of the integers in an interval, clipped to [0, count]: the least integer at or
    // above x. Clipped before the cast, which rounds towards zero, sees a number that it cannot
    // hold.
    static int first_from(float x, float count) {
        x = x > 0.0f ? x : 0.0f;
        x = x < count ? x : count;
        const int below = static_cast<int>(x);
        return below + (static_cast<float>(below) < x ? 1 : 0);
    }

    // Grid units. j = center_j + j_of_k dk + dj, i = center_i + i_of_j (j - center_j) + i_of_k dk +
    // di, and d'Ad = kk dk^2 + jj dj^2 + ii di^2.
    std::array<float, 3> center_{};
    float kk_ = 0, jj_ = 0, inv_jj_ = 0, inv_ii_ = 0;
    float j_of_k_ = 0, i_of_j_ = 0, i_of_k_ = 0;
    std::array<int, 3> dims_{};
    VoxelBox box_;
};

template <class Body>
void EllipsoidRows::for_each_in_layer(int k, const Body& body) const {
    constexpr int kRun = 8;  // rows worked out side by side
    const float dk = static_cast<float>(k) - center_[2];
    const float rest = 1.0f - kk_ * dk * dk;
    const float mid_j = center_[1] + j_of_k_ * dk;
    const auto [j_begin, j_end] = rows_of_layer(k);
    const auto nodes = static_cast<float>(dims_[0]);
    std::array<int, kRun> begin, end;
    for (int j0 = j_begin; j0 < j_end; j0 += kRun) {
        for (int r = 0; r < kRun; ++r) {
            const auto j = static_cast<float>(j0 + r);
            const float dj = j - mid_j;
            const float left = rest - jj_ * dj * dj;
            const float half_i = std::sqrt((left > 0.0f ? left : 0.0f) * inv_ii_);
            const float mid_i = center_[0] + i_of_j_ * (j - center_[1]) + i_of_k_ * dk;
            const auto slot = static_cast<std::size_t>(r);
            begin[slot] = first_from(mid_i - half_i, nodes);
            end[slot] = first_from(mid_i + half_i, nodes);
        }
        const int run = std::min(kRun, j_end - j0);
        for (int r = 0; r < run; ++r) {
            const auto slot = static_cast<std::size_t>(r);
            if (begin[slot] < end[slot]) body(VoxelRow{j0 + r, k, begin[slot], end[slot]});
        }
    }
}

}  // namespace ellicast::sender
