// sender/collapse_cost.hpp: private to sender/surface_decimation.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace ellicast::sender {

/// Integral of the squared distance to planes, as a function of the offset d from a vertex, without
/// what it is at d = 0:  Q(d) = d'Ad + 2 b'd  ([GH97] section 5). Relative to its vertex, since
/// there it is asked: so floats suffice.
struct Quadric {
    std::array<float, 6> A{};  // xx xy xz yy yz zz
    std::array<float, 3> b{};
    float area = 0;  // of the planes' weights

    [[nodiscard]] double at(const Eigen::Vector3d& d) const {
        const double x = d[0];
        const double y = d[1];
        const double z = d[2];
        return A[0] * x * x + A[3] * y * y + A[5] * z * z +
               2.0 * (A[1] * x * y + A[2] * x * z + A[4] * y * z + b[0] * x + b[1] * y + b[2] * z);
    }

    /// A plane of unit normal n through the vertex.
    void add_plane(const Eigen::Vector3d& n, double weight) {
        A[0] += static_cast<float>(weight * n[0] * n[0]);
        A[1] += static_cast<float>(weight * n[0] * n[1]);
        A[2] += static_cast<float>(weight * n[0] * n[2]);
        A[3] += static_cast<float>(weight * n[1] * n[1]);
        A[4] += static_cast<float>(weight * n[1] * n[2]);
        A[5] += static_cast<float>(weight * n[2] * n[2]);
        area += static_cast<float>(weight);
    }

    /// Another vertex' quadric, moved here by d.
    void add_moved(const Quadric& other, const Eigen::Vector3d& d) {
        const std::array<float, 6>& B = other.A;
        b[0] += other.b[0] + static_cast<float>(B[0] * d[0] + B[1] * d[1] + B[2] * d[2]);
        b[1] += other.b[1] + static_cast<float>(B[1] * d[0] + B[3] * d[1] + B[4] * d[2]);
        b[2] += other.b[2] + static_cast<float>(B[2] * d[0] + B[4] * d[1] + B[5] * d[2]);
        for (std::size_t k = 0; k < A.size(); ++k) A[k] += B[k];
        area += other.area;
    }
};

/// Triangles around an apex, to be asked for their distance from many points.
class TriangleFan {
  public:
    void clear(const Eigen::Vector3d& apex) {
        apex_ = apex;
        blades_.clear();
    }
    /// A triangle apex, a, b; `name` is the caller's.
    void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, std::uint32_t name) {
        Blade blade;
        blade.a = a - apex_;
        blade.b = b - apex_;
        blade.n = blade.a.cross(blade.b);
        blade.aa = blade.a.squaredNorm();
        blade.ab = blade.a.dot(blade.b);
        blade.bb = blade.b.squaredNorm();
        blade.nn = blade.n.squaredNorm();
        blade.name = name;
        blades_.push_back(blade);
    }
    [[nodiscard]] bool empty() const { return blades_.empty(); }

    struct Nearest {
        double squared_distance = std::numeric_limits<double>::infinity();
        std::uint32_t name = 0;
    };
    /// The first among equals.
    [[nodiscard]] Nearest nearest(const Eigen::Vector3d& x) const {
        const Eigen::Vector3d w = x - apex_;
        Nearest result;
        for (const Blade& blade : blades_) {
            const double d2 = blade.squared_distance(w, result.squared_distance);
            if (d2 < result.squared_distance) result = {d2, blade.name};
        }
        return result;
    }

  private:
    struct Blade {
        Eigen::Vector3d a, b, n;
        double aa = 0, ab = 0, bb = 0, nn = 0;
        std::uint32_t name = 0;

        static double to_segment(const Eigen::Vector3d& w, const Eigen::Vector3d& s, double ss) {
            const double t = ss > 0.0 ? std::clamp(w.dot(s) / ss, 0.0, 1.0) : 0.0;
            return (w - t * s).squaredNorm();
        }

        /// May give `enough` or more instead, where the distance is at least that.
        [[nodiscard]] double squared_distance(const Eigen::Vector3d& w, double enough) const {
            const double height = n.dot(w);
            if (nn > 0.0 && height * height >= enough * nn) return enough;
            // Barycentric coordinates of a and b, times nn.
            const double wa = w.dot(a);
            const double wb = w.dot(b);
            const double s = bb * wa - ab * wb;
            const double t = aa * wb - ab * wa;
            if (nn > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= nn) return height * height / nn;
            // The closest point lies on an edge that has x on its outer side.
            double least = enough;
            if (t <= 0.0) least = std::min(least, to_segment(w, a, aa));
            if (s <= 0.0) least = std::min(least, to_segment(w, b, bb));
            if (s + t >= nn) {
                least = std::min(least, to_segment(w - a, b - a, aa - 2.0 * ab + bb));
            }
            return least;
        }
    };

    Eigen::Vector3d apex_ = Eigen::Vector3d::Zero();
    std::vector<Blade> blades_;
};

}  // namespace ellicast::sender
