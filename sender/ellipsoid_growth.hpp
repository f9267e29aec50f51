// sender/ellipsoid_growth.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "common/ellipsoid.hpp"
#include "sender/constraint_search.hpp"

namespace ellicast::sender {

/// Where a growth starts: a point of the surface and the unit normal that points into the solid.
struct Seed {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d inward = Eigen::Vector3d::UnitZ();
};

/// Lengths are shares of the bounding-box diagonal, because growth runs in a frame where that is 1.
struct GrowthOptions {
    double epsilon = 0.00075;      // by how much contacts are shifted inwards
    double max_aspect = 8;         // K: longest over shortest axis
    double max_radius = 0.3;       // of the sphere; a ball in a box of diagonal 1 has at most 0.289
    double max_half_length = 0.5;  // of the ellipsoid
    double min_radius =
        1e-5;  // of the result; below, nothing is gained and receivers would refuse it
};

/// Constraints met by a growth, in the order of its stages. They are likely to be met by the
/// growth from a seed near by, too, and make its search short.
struct GrowthContacts {
    static constexpr std::size_t kMax = 4;
    std::array<std::uint32_t, kMax> constraints{};
    std::size_t count = 0;

    void add(std::uint32_t constraint) {
        if (count < kMax) constraints[count++] = constraint;
    }
    [[nodiscard]] std::span<const std::uint32_t> view() const {
        return {constraints.data(), count};
    }
};

/// The sphere of stage one, already shrunk by epsilon about its centre. p and q are the shifted
/// touching points p', q' of [BK02]'s remark: they lie on the sphere, and their inward normals are
/// centre - p and centre - q, both of length `radius`.
struct TouchingSphere {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double radius = 0;
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    Eigen::Vector3d q = Eigen::Vector3d::Zero();
    std::uint32_t touched = 0;  // constraint behind q
};

/// Stage one, [BK02] section 3.2: the largest sphere that touches the seed from inside and holds no
/// constraint. Empty when nothing is met up to max_radius (an open or inverted surface), or when
/// the sphere is too small to be shrunk.
std::optional<TouchingSphere> grow_sphere(const Seed& seed, const ConstraintSearch& constraints,
                                          const GrowthOptions& options,
                                          std::span<const std::uint32_t> guesses);

/// Q1: the sphere as a quadric.
Eigen::Matrix4d sphere_quadric(const TouchingSphere& sphere);

/// Q2: the product of the tangent planes at p and q, negative inside their wedge.
Eigen::Matrix4d wedge_quadric(const TouchingSphere& sphere);

/// Up to which alpha Q1 + alpha Q2 is an ellipsoid whose longest axis is at most max_aspect times
/// the shortest. Below the limit alpha_0 = 2 / (r^2 (1 + cos(n_p, n_q))) of the ellipsoid type.
double largest_alpha(const TouchingSphere& sphere, double max_aspect);

/// Q3(x) = Q(P x), P the orthogonal projection onto the plane through `point` with unit normal
/// `normal`: the cylinder over the ellipse that the plane cuts from Q. It needs no eigenvectors.
/// Departs from [BK02], whose principal axes come from the skew (u, v) basis of eq. (4), in which
/// eigenvectors do not map to orthogonal axes of space; the cylinder would not pass through r.
Eigen::Matrix4d profile_cylinder(const Eigen::Matrix4d& Q, const Eigen::Vector3d& point,
                                 const Eigen::Vector3d& normal);

/// The whole growth from one seed: sphere, alpha, beta, then inflation (or shrinking) about the
/// centre until the points of `surface`, those of the unsmoothed mesh, are touched. No point of
/// `surface` lies inside the result (up to rounding). Empty when a stage fails; see the stages.
/// `contacts`: in, those of a growth near by or none; out, those of this one.
std::optional<common::Ellipsoid> grow_ellipsoid(const Seed& seed,
                                                const ConstraintSearch& constraints,
                                                const ConstraintSearch& surface,
                                                const GrowthOptions& options,
                                                GrowthContacts& contacts);

}  // namespace ellicast::sender
