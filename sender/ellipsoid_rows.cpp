// sender/ellipsoid_rows.cpp
#include "sender/ellipsoid_rows.hpp"

#include <Eigen/Core>

namespace ellicast::sender {

EllipsoidRows::EllipsoidRows(const common::Ellipsoid& ellipsoid, const common::GridFrame& frame)
    : center_((ellipsoid.center - frame.origin) / frame.spacing), dims_(frame.dims) {
    const Eigen::Matrix3d L = ellipsoid.L / frame.spacing;
    const Eigen::Matrix3d L_inv =
        L.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity().eval());
    const Eigen::Matrix3d A = L_inv.transpose() * L_inv;
    // Completing the square in i.
    inv_ii_ = 1.0 / A(0, 0);
    i_of_j_ = -A(0, 1) * inv_ii_;
    i_of_k_ = -A(0, 2) * inv_ii_;
    jj_ = A(1, 1) + A(0, 1) * i_of_j_;
    const double jk = A(1, 2) + A(0, 1) * i_of_k_;
    // Completing the square in j. What remains is 1 / (extent in k)^2, which L gives without
    // cancellation: the support in direction e_k is the norm of row k.
    inv_jj_ = 1.0 / jj_;
    j_of_k_ = -jk * inv_jj_;
    half_k_ = L.row(2).norm();
    kk_ = 1.0 / (half_k_ * half_k_);
}

}  // namespace ellicast::sender
