// sender/ellipsoid_rows.cpp
#include "sender/ellipsoid_rows.hpp"

#include <Eigen/Core>

namespace ellicast::sender {

EllipsoidRows::EllipsoidRows(const common::Ellipsoid& ellipsoid, const common::GridFrame& frame)
    : dims_(frame.dims) {
    const Eigen::Vector3d center = (ellipsoid.center - frame.origin) / frame.spacing;
    const Eigen::Matrix3d L = ellipsoid.L / frame.spacing;
    const Eigen::Matrix3d L_inv =
        L.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity().eval());
    const Eigen::Matrix3d A = L_inv.transpose() * L_inv;
    // Completing the square in i, then in j. What remains of k is 1 / (extent in k)^2, which L
    // gives without cancellation: the support in direction e_k is the norm of row k.
    const double i_of_j = -A(0, 1) / A(0, 0);
    const double i_of_k = -A(0, 2) / A(0, 0);
    const double jj = A(1, 1) + A(0, 1) * i_of_j;
    const double jk = A(1, 2) + A(0, 1) * i_of_k;
    inv_ii_ = static_cast<float>(1.0 / A(0, 0));
    i_of_j_ = static_cast<float>(i_of_j);
    i_of_k_ = static_cast<float>(i_of_k);
    jj_ = static_cast<float>(jj);
    inv_jj_ = static_cast<float>(1.0 / jj);
    j_of_k_ = static_cast<float>(-jk / jj);
    kk_ = static_cast<float>(1.0 / L.row(2).squaredNorm());
    constexpr double kWiden = 1e-2;  // more than float32 can be wrong by
    for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<Eigen::Index>(a);
        const double half = L.row(axis).norm() + kWiden;
        const auto count = static_cast<double>(dims_[a]);
        center_[a] = static_cast<float>(center[axis]);
        const double from = std::clamp(std::ceil(center[axis] - half), 0.0, count);
        const double to = std::clamp(std::floor(center[axis] + half) + 1.0, from, count);
        box_.begin[a] = static_cast<int>(from);
        box_.end[a] = static_cast<int>(to);
    }
}

}  // namespace ellicast::sender
