// common/ellipsoid.cpp
#include "common/ellipsoid.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace ellicast::common {
namespace {

// A = (L L')^-1 by forward substitution, never by a general inverse.
Eigen::Matrix3d shape_matrix(const Eigen::Matrix3d& L) {
    const Eigen::Matrix3d L_inv =
        L.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity().eval());
    return L_inv.transpose() * L_inv;
}

}  // namespace

Eigen::Matrix4d quadric_matrix(const Ellipsoid& ellipsoid) {
    const Eigen::Matrix3d A = shape_matrix(ellipsoid.L);
    const Eigen::Vector3d Ac = A * ellipsoid.center;
    Eigen::Matrix4d Q;
    Q.topLeftCorner<3, 3>() = A;
    Q.topRightCorner<3, 1>() = -Ac;
    Q.bottomLeftCorner<1, 3>() = -Ac.transpose();
    Q(3, 3) = ellipsoid.center.dot(Ac) - 1.0;
    return Q;
}

std::optional<Ellipsoid> ellipsoid_from_quadric(const Eigen::Matrix4d& Q) {
    if (!Q.allFinite()) return std::nullopt;
    const Eigen::Matrix3d A = Q.topLeftCorner<3, 3>().selfadjointView<Eigen::Lower>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A);
    if (eigen.info() != Eigen::Success) return std::nullopt;
    const Eigen::Vector3d& lambda = eigen.eigenvalues();
    // Relative bound: below it the longest axis is over 1e6 times the shortest, numerically a
    // cylinder.
    if (!(lambda[0] > 1e-12 * lambda[2]) || !(lambda[2] > 0.0)) return std::nullopt;

    // Centre: A c + b = 0. Scale: at the centre the form takes its least value, -k.
    const Eigen::Matrix3d& V = eigen.eigenvectors();
    const Eigen::Vector3d b = Q.topRightCorner<3, 1>();
    Ellipsoid ellipsoid;
    ellipsoid.center = -(V * (V.transpose() * b).cwiseQuotient(lambda));
    const double k = -(b.dot(ellipsoid.center) + Q(3, 3));
    if (!(k > 0.0) || !ellipsoid.center.allFinite()) return std::nullopt;

    // (A / k)^-1 = L L'.
    const Eigen::Matrix3d S = V * (k * lambda.cwiseInverse()).asDiagonal() * V.transpose();
    const Eigen::LLT<Eigen::Matrix3d> llt(S);
    if (llt.info() != Eigen::Success) return std::nullopt;
    ellipsoid.L = llt.matrixL();
    if (!ellipsoid.L.allFinite() || !(ellipsoid.L.diagonal().minCoeff() > 0.0)) return std::nullopt;
    return ellipsoid;
}

Eigen::Vector3d semi_axes(const Ellipsoid& ellipsoid) {
    const Eigen::Matrix3d S = ellipsoid.L * ellipsoid.L.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(S, Eigen::EigenvaluesOnly);
    return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
}

double volume(const Ellipsoid& ellipsoid) {
    return 4.0 / 3.0 * std::numbers::pi * ellipsoid.L.diagonal().prod();
}

Eigen::AlignedBox3d bounding_box(const Ellipsoid& ellipsoid) {
    // The support of {L u} in direction e_i is |L' e_i|, the norm of row i.
    const Eigen::Vector3d half = ellipsoid.L.rowwise().norm();
    return {ellipsoid.center - half, ellipsoid.center + half};
}

EllipsoidDistance::EllipsoidDistance(const Ellipsoid& ellipsoid)
    : center_(ellipsoid.center),
      A_(shape_matrix(ellipsoid.L)),
      value_at_center_(-semi_axes(ellipsoid)[0]) {
    assert(ellipsoid.L.diagonal().minCoeff() > 0.0);
}

}  // namespace ellicast::common
