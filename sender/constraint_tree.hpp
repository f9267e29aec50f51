// sender/constraint_tree.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace ellicast::sender {

/// The polynomial [x;1]' Q [x;1] of a symmetric 4x4 matrix, multiplied out: nine products an
/// evaluation.
struct QuadraticForm {
    double xx = 0, yy = 0, zz = 0;  // Q_ii
    double xy = 0, xz = 0, yz = 0;  // 2 Q_ij
    double x = 0, y = 0, z = 0;     // 2 Q_i4
    double c = 0;                   // Q_44

    QuadraticForm() = default;
    explicit QuadraticForm(const Eigen::Matrix4d& Q);

    [[nodiscard]] double operator()(double px, double py, double pz) const {
        return px * (xx * px + xy * py + xz * pz + x) + py * (yy * py + yz * pz + y) +
               pz * (zz * pz + z) + c;
    }
    [[nodiscard]] double operator()(const Eigen::Vector3d& p) const {
        return (*this)(p[0], p[1], p[2]);
    }
};

/// A point that stops the growth of F0 + t F1, and when.
struct Contact {
    std::uint32_t point = 0;
    double t = 0;
};

/// When the point stops the growth: the t >= 0 with F0(x) + t F1(x) = 0, given F1(x) < 0; zero when
/// x lies inside from the start. Empty when F1(x) >= 0: growth moves away from x.
std::optional<double> contact_parameter(const QuadraticForm& F0, const QuadraticForm& F1,
                                        const Eigen::Vector3d& x);

/// Answers the one question of growth ([BK02] section 3.2 for all its stages, see DESIGN section
/// 3): which constraint point is met first when F0 + t F1 grows with t?
///
/// A flat tree with eight children a node and sixteen points a leaf, both as structures of arrays,
/// so that the compiler makes vector code of the two loops that cost. At the best t so far F = F0 +
/// t F1 is convex, hence F(x) >= F(m) - sum_i |grad F(m)'a_i| in a box of centre m and half-axes
/// a_i, and boxes where that is positive hold nothing better. The boxes are turned along their
/// points' principal axes: a patch of surface is flat, and a grown shape lies flat against many
/// patches. Immutable once built; safe to ask from many threads. Memory about 70 bytes a point;
/// build O(n log n); a query about O(log n).
class ConstraintTree {
  public:
    /// Requires finite points, fewer than 2^32 (asserted).
    explicit ConstraintTree(std::vector<Eigen::Vector3d> points);

    /// A tree over other positions of the same points, with the leaves of `like`: built in linear
    /// time, and as good when the points have moved little. Requires as many points (asserted).
    ConstraintTree(std::vector<Eigen::Vector3d> points, const ConstraintTree& like);

    /// The contact with the least t in [0, t_max], ties by the smaller index: exactly that of a
    /// scan over all points. Empty when there is none. `guesses` are points likely to be met early;
    /// they cut the search short and change nothing in the result. Requires F0 + t F1 convex for
    /// all t in [0, t_max], t_max finite; F0 >= 0 at all points with F1 < 0 (a point where it is
    /// not stops at t = 0).
    [[nodiscard]] std::optional<Contact> first_contact(
        const QuadraticForm& F0, const QuadraticForm& F1, double t_max,
        std::span<const std::uint32_t> guesses = {}) const;

    [[nodiscard]] const std::vector<Eigen::Vector3d>& points() const { return points_; }

  private:
    static constexpr std::size_t kChildren = 8;
    static constexpr std::size_t kLeafPoints = 16;

    struct alignas(64) Leaf {
        std::array<double, kLeafPoints> x, y, z;  // the last point repeats when fewer
    };
    // Boxes of up to eight children. half_axes[3 i + c] is component c of half-axis i.
    struct alignas(64) Node {
        std::array<double, kChildren> mx, my, mz;
        std::array<std::array<double, kChildren>, 9> half_axes;
    };
    class Query;

    void sort_into_leaves();
    void fill_leaves();
    void build_nodes();

    std::vector<Eigen::Vector3d> points_;  // as given
    std::vector<std::uint32_t> order_;     // index of the point in each slot; slot / 16 is its leaf
    std::vector<Leaf> leaves_;
    std::vector<std::vector<Node>>
        levels_;         // levels_[0] over leaves, each next over the one before
    double extent_ = 0;  // largest absolute coordinate
};

}  // namespace ellicast::sender
