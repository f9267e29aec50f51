// common/ellipsoid.hpp
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace ellicast::common {

/// The solid {center + L u : |u| <= 1}, L lower triangular with positive diagonal. These are the
/// nine scalars of [BK02] section 1 in a form that no choice of numbers turns into a hyperboloid.
/// Frame: the model's. Units: lengths in model units.
struct Ellipsoid {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    Eigen::Matrix3d L = Eigen::Matrix3d::Identity();  // strictly upper part is zero
};

/// The symmetric 4x4 matrix Q of [BK02] section 2 with [x;1]' Q [x;1] = |L^-1 (x - c)|^2 - 1:
/// negative inside, zero on the surface, positive outside.
Eigen::Matrix4d quadric_matrix(const Ellipsoid& ellipsoid);

/// The ellipsoid {x : [x;1]' Q [x;1] <= 0}, whatever positive factor Q carries. Empty when Q is not
/// of ellipsoid type (the eigenvalues of its upper left 3x3 block not all positive, [BK02]
/// section 3.2), has no interior, or is not finite. Only the lower triangle of Q's 3x3 block is
/// read.
std::optional<Ellipsoid> ellipsoid_from_quadric(const Eigen::Matrix4d& Q);

/// The three semi-axis lengths, ascending.
Eigen::Vector3d semi_axes(const Ellipsoid& ellipsoid);

/// Volume, 4/3 pi det L.
double volume(const Ellipsoid& ellipsoid);

/// Tight axis-aligned bounding box.
Eigen::AlignedBox3d bounding_box(const Ellipsoid& ellipsoid);

/// An ellipsoid prepared for many evaluations of the distance estimate s (s - 1) / |A d| with
/// A = (L L')^-1, d = x - c, s = sqrt(d' A d): a length, negative inside, exact for spheres and to
/// first order at every surface. At d = 0 it is minus the smallest semi-axis.
class EllipsoidDistance {
  public:
    /// Requires a positive diagonal of L (asserted).
    explicit EllipsoidDistance(const Ellipsoid& ellipsoid);

    /// Four points of a row along x.
    class Row {
      public:
        Row(const EllipsoidDistance& distance, const Eigen::Array4d& x, double y, double z);

        [[nodiscard]] bool all_outside() const { return (s2_ >= 1.0).all(); }
        [[nodiscard]] Eigen::Array4d values() const;

      private:
        Eigen::Array4d s2_;   // s^2
        Eigen::Array4d Ad2_;  // |A d|^2
        double value_at_center_;
    };

  private:
    Eigen::Vector3d center_;
    Eigen::Matrix3d A_;
    double value_at_center_;
};

inline EllipsoidDistance::Row::Row(const EllipsoidDistance& distance, const Eigen::Array4d& x,
                                   double y, double z)
    : value_at_center_(distance.value_at_center_) {
    const Eigen::Matrix3d& A = distance.A_;
    const Eigen::Array4d dx = x - distance.center_[0];
    const double dy = y - distance.center_[1];
    const double dz = z - distance.center_[2];
    const Eigen::Array4d u = A(0, 0) * dx + A(0, 1) * dy + A(0, 2) * dz;
    const Eigen::Array4d v = A(1, 0) * dx + A(1, 1) * dy + A(1, 2) * dz;
    const Eigen::Array4d w = A(2, 0) * dx + (A(2, 1) * dy + A(2, 2) * dz);
    s2_ = dx * u + dy * v + dz * w;
    Ad2_ = u * u + v * v + w * w;
}

inline Eigen::Array4d EllipsoidDistance::Row::values() const {
    const Eigen::Array4d s = s2_.max(0.0).sqrt();
    const Eigen::Array4d Ad = Ad2_.sqrt();
    return (Ad > 0.0 && s != 0.0).select(s * (s - 1.0) / Ad, value_at_center_);
}

}  // namespace ellicast::common
