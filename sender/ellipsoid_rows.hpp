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

/// An ellipsoid ready to be rasterised by rows. A node x is inside when d'Ad <= 1, d = x - c, A =
/// (L L')^-1. With i eliminated that is a quadratic in (j, k), with j eliminated one in k, so that
/// layers, rows of a layer and nodes of a row each come from one square root and no node is tested.
class EllipsoidRows {
  public:
    EllipsoidRows(const common::Ellipsoid& ellipsoid, const common::GridFrame& frame);

    /// Calls body(row) for every row of the grid that has nodes inside and first_k <= k < last_k,
    /// in order of k, then j.
    template <class Body>
    void for_each(int first_k, int last_k, const Body& body) const {
        const auto [k_begin, k_end] = nodes_within(center_[2], half_k_, last_k);
        for (int k = std::max(k_begin, first_k); k < k_end; ++k) {
            const double dk = k - center_[2];
            const double rest = 1.0 - kk_ * dk * dk;
            if (rest < 0.0) continue;
            const double half_j = std::sqrt(rest * inv_jj_);
            const auto [j_begin, j_end] = nodes_within(center_[1] + j_of_k_ * dk, half_j, dims_[1]);
            for (int j = j_begin; j < j_end; ++j) {
                const double dj = j - center_[1] - j_of_k_ * dk;
                const double half_i = std::sqrt(std::max(0.0, rest - jj_ * dj * dj) * inv_ii_);
                const double i_mid = center_[0] + i_of_j_ * (j - center_[1]) + i_of_k_ * dk;
                const auto [i_begin, i_end] = nodes_within(i_mid, half_i, dims_[0]);
                if (i_begin < i_end) body(VoxelRow{j, k, i_begin, i_end});
            }
        }
    }

    template <class Body>
    void for_each(const Body& body) const {
        for_each(0, dims_[2], body);
    }

  private:
    // [begin, end) of the integers in [mid - half, mid + half], clipped to [0, count).
    static std::array<int, 2> nodes_within(double mid, double half, int count) {
        // Clipped first, so that the casts, which round towards zero, see numbers they can hold.
        const double low = std::clamp(mid - half, 0.0, static_cast<double>(count));
        const double high = std::clamp(mid + half + 1.0, 0.0, static_cast<double>(count));
        const int below = static_cast<int>(low);
        return {below + (low > below ? 1 : 0), static_cast<int>(high)};
    }

    // Grid units. (j - c_j) = j_of_k dk + dj, (i - c_i) = i_of_j (j - c_j) + i_of_k dk + di, and
    // d'Ad = kk dk^2 + jj dj^2 + ii di^2.
    Eigen::Vector3d center_;
    double kk_, jj_, inv_jj_, inv_ii_, half_k_;
    double j_of_k_, i_of_j_, i_of_k_;
    std::array<int, 3> dims_;
};

}  // namespace ellicast::sender
