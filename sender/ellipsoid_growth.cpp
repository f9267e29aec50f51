// sender/ellipsoid_growth.cpp
#include "sender/ellipsoid_growth.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Guesses = std::span<const std::uint32_t>;

// [x;1]'Q[x;1] = x'x - 2 m'x + c.
QuadraticForm round_form(const Vector3d& m, double c) {
    QuadraticForm F;
    F.xx = F.yy = F.zz = 1.0;
    F.x = -2.0 * m[0];
    F.y = -2.0 * m[1];
    F.z = -2.0 * m[2];
    F.c = c;
    return F;
}

QuadraticForm linear_form(const Vector3d& g, double c) {
    QuadraticForm F;
    F.x = g[0];
    F.y = g[1];
    F.z = g[2];
    F.c = c;
    return F;
}

// What stage two hands to stage three.
struct StretchedEllipsoid {
    Matrix4d Q = Matrix4d::Zero();  // Q1 + alpha Q2
    Vector3d normal =
        Vector3d::Zero();  // of the plane through the contacts; zero when there is none
};

// Unit normal of the plane p, q, r; of the plane p, q, centre when p, q, r are nearly collinear or
// there is no r; zero when p and q are opposite each other.
Vector3d profile_normal(const TouchingSphere& sphere, const std::optional<Vector3d>& r) {
    constexpr double kLeastSine = 0.05;  // about 3 degrees: below, rounding of r turns the plane
    if (r) {
        const Vector3d u = sphere.q - sphere.p;
        const Vector3d v = *r - sphere.p;
        const Vector3d n = u.cross(v);
        if (n.norm() > kLeastSine * u.norm() * v.norm()) return n.normalized();
    }
    const Vector3d n = (sphere.center - sphere.p).cross(sphere.center - sphere.q);
    if (n.norm() > kLeastSine * sphere.radius * sphere.radius) return n.normalized();
    return Vector3d::Zero();
}

// r' of [BK02]'s remark: r shifted inwards along the normal of Q.
Vector3d shifted_inwards(const Matrix4d& Q, const Vector3d& r, double epsilon) {
    const Vector3d gradient = (Q * r.homogeneous()).head<3>();
    return r - epsilon * gradient.normalized();
}

// Stage two, [BK02] eq. (1) and (2).
StretchedEllipsoid grow_in_wedge(const TouchingSphere& sphere, const ConstraintSearch& constraints,
                                 const GrowthOptions& options, Guesses guesses,
                                 GrowthContacts& contacts) {
    const Matrix4d Q1 = sphere_quadric(sphere);
    const Matrix4d Q2 = wedge_quadric(sphere);
    const QuadraticForm F1(Q1), F2(Q2);
    double alpha = largest_alpha(sphere, options.max_aspect);
    const std::optional<Contact> contact = constraints.first_contact(F1, F2, alpha, guesses);
    std::optional<Vector3d> shifted;
    if (contact) {
        contacts.add(contact->constraint);
        const Vector3d& r = contact->point;
        const double epsilon = std::min(options.epsilon, 0.1 * sphere.radius);
        shifted = shifted_inwards(Q1 + contact->t * Q2, r, epsilon);
        // The alpha whose ellipsoid passes through r' instead of r.
        const double at_shifted = F2(*shifted);
        alpha = at_shifted < 0.0 ? std::clamp(-F1(*shifted) / at_shifted, 0.0, contact->t) : 0.0;
    }
    return {Q1 + alpha * Q2, profile_normal(sphere, shifted)};
}

// Up to which beta Q + beta Q3 stays within the longest length allowed: with the section fixed, the
// half length along the normal grows as h_n sqrt(1 + beta). beta never changes the ellipsoid type.
double largest_beta(const Ellipsoid& ellipsoid, const Vector3d& normal,
                    const GrowthOptions& options) {
    const double h_n = (ellipsoid.L.transpose() * normal).norm();
    const double longest =
        std::min(options.max_half_length, options.max_aspect * common::semi_axes(ellipsoid)[0]);
    return longest * longest / (h_n * h_n) - 1.0;
}

// Stage three, [BK02] eq. (3).
Matrix4d grow_along_cylinder(const StretchedEllipsoid& stretched, const Vector3d& p,
                             const ConstraintSearch& constraints, const GrowthOptions& options,
                             Guesses guesses, GrowthContacts& contacts) {
    if (stretched.normal.isZero()) return stretched.Q;
    const std::optional<Ellipsoid> ellipsoid = common::ellipsoid_from_quadric(stretched.Q);
    if (!ellipsoid) return stretched.Q;
    double beta = largest_beta(*ellipsoid, stretched.normal, options);
    if (!(beta > 0.0)) return stretched.Q;
    const Matrix4d Q3 = profile_cylinder(stretched.Q, p, stretched.normal);
    const std::optional<Contact> contact =
        constraints.first_contact(QuadraticForm(stretched.Q), QuadraticForm(Q3), beta, guesses);
    if (contact) {
        contacts.add(contact->constraint);
        beta = contact->t;
    }
    return stretched.Q + beta * Q3;
}

// Scales about the centre until the surface's points are touched. d'Ad = s^2 is the same question
// once more: F0 = d'Ad, F1 = -1, t = s^2.
std::optional<Ellipsoid> inflate(Ellipsoid ellipsoid, const ConstraintSearch& surface,
                                 const GrowthOptions& options, GrowthContacts& contacts) {
    Matrix4d Q = common::quadric_matrix(ellipsoid);
    Q(3, 3) += 1.0;  // d'Ad
    const Vector3d axes = common::semi_axes(ellipsoid);
    const double largest_scale = options.max_half_length / axes[2];
    const double t_max = largest_scale * largest_scale;
    const std::optional<Contact> contact = surface.first_contact(
        QuadraticForm(Q), linear_form(Vector3d::Zero(), -1.0), t_max, contacts.view());
    if (contact) contacts.add(contact->constraint);
    const double scale = std::sqrt(contact ? contact->t : t_max);
    if (!(scale * axes[0] >= options.min_radius)) return std::nullopt;
    ellipsoid.L *= scale;
    return ellipsoid;
}

}  // namespace

std::optional<TouchingSphere> grow_sphere(const Seed& seed, const ConstraintSearch& constraints,
                                          const GrowthOptions& options, Guesses guesses) {
    const Vector3d& n = seed.inward;
    // A hair inwards, so that copies of the seed's own point lie behind it; far less than epsilon,
    // which may be more than a thin wall has.
    const Vector3d p = seed.point + 0.01 * options.epsilon * n;
    // r(x) = |x - p|^2 / (2 (x - p)'n): F0 = |x - p|^2, F1 = -2 n'(x - p).
    const std::optional<Contact> contact = constraints.first_contact(
        round_form(p, p.squaredNorm()), linear_form(-2.0 * n, 2.0 * n.dot(p)), options.max_radius,
        guesses);
    if (!contact) return std::nullopt;
    const double r_opt = contact->t;
    TouchingSphere sphere;
    sphere.center = p + r_opt * n;
    sphere.radius = r_opt - std::min(options.epsilon, 0.1 * r_opt);
    if (!(sphere.radius >= options.min_radius)) return std::nullopt;
    sphere.touched = contact->constraint;
    const Vector3d to_q = contact->point - sphere.center;
    sphere.p = sphere.center - sphere.radius * n;
    sphere.q = sphere.center + sphere.radius * to_q.normalized();
    return sphere;
}

Matrix4d sphere_quadric(const TouchingSphere& sphere) {
    Matrix4d Q = Matrix4d::Identity();
    Q.topRightCorner<3, 1>() = -sphere.center;
    Q.bottomLeftCorner<1, 3>() = -sphere.center.transpose();
    Q(3, 3) = sphere.center.squaredNorm() - sphere.radius * sphere.radius;
    return Q;
}

Matrix4d wedge_quadric(const TouchingSphere& sphere) {
    const Vector3d n_p = sphere.center - sphere.p;
    const Vector3d n_q = sphere.center - sphere.q;
    // (x - p)'n_p (q - x)'n_q, as the product of two row vectors applied to [x;1].
    Eigen::Vector4d plane_p, plane_q;
    plane_p << n_p, -n_p.dot(sphere.p);
    plane_q << -n_q, n_q.dot(sphere.q);
    const Matrix4d N = plane_p * plane_q.transpose();
    return 0.5 * (N + N.transpose());
}

double largest_alpha(const TouchingSphere& sphere, double max_aspect) {
    const double r2 = sphere.radius * sphere.radius;
    const double cosine =
        std::clamp((sphere.center - sphere.p).dot(sphere.center - sphere.q) / r2, -1.0, 1.0);
    // Eigenvalues of I - alpha (n_p n_q' + n_q n_p') / 2: 1, 1 - alpha r^2 (1 + cos) / 2 (long
    // axis) and 1 + alpha r^2 (1 - cos) / 2 (short axis). Their ratio may be K^2.
    const double K2 = max_aspect * max_aspect;
    return 2.0 / r2 * (K2 - 1.0) / ((1.0 - cosine) + K2 * (1.0 + cosine));
}

Matrix4d profile_cylinder(const Matrix4d& Q, const Vector3d& point, const Vector3d& normal) {
    Matrix4d P = Matrix4d::Identity();
    P.topLeftCorner<3, 3>() -= normal * normal.transpose();
    P.topRightCorner<3, 1>() = normal * normal.dot(point);
    return P.transpose() * Q * P;
}

std::optional<Ellipsoid> grow_ellipsoid(const Seed& seed, const ConstraintSearch& constraints,
                                        const ConstraintSearch& surface,
                                        const GrowthOptions& options, GrowthContacts& contacts) {
    const GrowthContacts near_by = contacts;
    contacts = {};
    const std::optional<TouchingSphere> sphere =
        grow_sphere(seed, constraints, options, near_by.view());
    if (!sphere) return std::nullopt;
    contacts.add(sphere->touched);
    const StretchedEllipsoid stretched =
        grow_in_wedge(*sphere, constraints, options, near_by.view(), contacts);
    const Matrix4d Q =
        grow_along_cylinder(stretched, sphere->p, constraints, options, near_by.view(), contacts);
    const std::optional<Ellipsoid> ellipsoid = common::ellipsoid_from_quadric(Q);
    if (!ellipsoid) return std::nullopt;
    return inflate(*ellipsoid, surface, options, contacts);
}

}  // namespace ellicast::sender
