// sender/constraint_tree.cpp
#include "sender/constraint_tree.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <utility>

namespace ellicast::sender {

using Eigen::Vector3d;

ConstraintTree::ConstraintTree(Constraints constraints) : constraints_(std::move(constraints)) {
    order_constraints();
    build();
}

ConstraintTree::ConstraintTree(Constraints constraints, const ConstraintTree& like)
    : constraints_(std::move(constraints)),
      point_order_(like.point_order_),
      triangle_order_(like.triangle_order_) {
    assert(constraints_.points.size() == point_order_.size());
    assert(constraints_.triangles.size() == triangle_order_.size());
    build();
}

void ConstraintTree::order_constraints() {
    assert(constraints_.size() < std::numeric_limits<std::uint32_t>::max());
    point_order_ = compact_order(constraints_.points, kLeafPoints);
    std::vector<Vector3d> centroids;
    centroids.reserve(constraints_.triangles.size());
    for (const auto& [a, b, c] : constraints_.triangles) centroids.push_back((a + b + c) / 3.0);
    triangle_order_ = compact_order(centroids, kLeafTriangles);
}

void ConstraintTree::build() {
    std::vector<Vector3d> ordered;
    ordered.reserve(point_order_.size());
    for (const std::uint32_t i : point_order_) ordered.push_back(constraints_.points[i]);
    point_boxes_ = BoxTree(ordered, kLeafPoints);
    leaves_.resize(point_boxes_.leaves());
    for (std::size_t slot = 0; slot < leaves_.size() * kLeafPoints; ++slot) {
        const Vector3d& p = ordered[std::min(slot, ordered.size() - 1)];
        Leaf& leaf = leaves_[slot / kLeafPoints];
        leaf.x[slot % kLeafPoints] = p[0];
        leaf.y[slot % kLeafPoints] = p[1];
        leaf.z[slot % kLeafPoints] = p[2];
    }
    std::vector<Vector3d> corners;
    corners.reserve(3 * triangle_order_.size());
    for (const std::uint32_t i : triangle_order_) {
        const Corners& triangle = constraints_.triangles[i];
        corners.insert(corners.end(), triangle.begin(), triangle.end());
    }
    triangle_boxes_ = BoxTree(corners, 3 * kLeafTriangles);
    for (const std::vector<Vector3d>* all : {&ordered, &corners}) {
        for (const Vector3d& p : *all) {
            assert(p.allFinite());
            extent_ = std::max(extent_, p.cwiseAbs().maxCoeff());
        }
    }
}

// One search: the best contact so far, and F0 + t F1 at its t. A constraint so close to that form's
// zero that rounding hides on which side it is, is decided by its own t; so neither ties nor the
// outcome depend on the order of the search.
class ConstraintTree::Query {
  public:
    Query(const ConstraintTree& tree, const QuadraticForm& F0, const QuadraticForm& F1,
          double t_max)
        : tree_(tree), F0_(F0), F1_(F1), t_max_(t_max), best_{kNone, Vector3d::Zero(), t_max} {
        tighten();
    }

    void offer(std::uint32_t constraint) {
        if (constraint < tree_.constraints_.points.size()) {
            offer_point(constraint);
        } else if (constraint < tree_.constraints_.size()) {
            offer_triangle(constraint);
        }
    }

    void offer_point(std::uint32_t number) {
        const Vector3d& x = tree_.constraints_.points[number];
        const std::optional<double> t = contact_parameter(F0_, F1_, x);
        if (t) take({number, x, *t});
    }

    void offer_triangle(std::uint32_t number) {
        const Corners& triangle =
            tree_.constraints_.triangles[number - tree_.constraints_.points.size()];
        if (!least_point(F_, triangle, slack_)) return;
        // From t_max, not from the best t, so that the answer is the triangle's own.
        const auto contact = triangle_contact(F0_, F1_, triangle, t_max_);
        if (contact) take({number, contact->point, contact->t});
    }

    [[nodiscard]] const QuadraticForm& form() const { return F_; }
    [[nodiscard]] double slack() const { return slack_; }
    [[nodiscard]] double version() const { return best_.t; }
    [[nodiscard]] const ConstraintTree& tree() const { return tree_; }

    [[nodiscard]] std::optional<Contact> result() const {
        if (best_.constraint == kNone) return std::nullopt;
        return best_;
    }

  private:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    void take(const Contact& contact) {
        if (contact.t > best_.t) return;
        if (contact.t == best_.t && contact.constraint >= best_.constraint) return;
        best_ = contact;
        tighten();
    }

    void tighten() {
        F_ = combine(F0_, best_.t, F1_);
        slack_ = F_.rounding_slack(tree_.extent_);
    }

    const ConstraintTree& tree_;
    const QuadraticForm F0_, F1_;
    const double t_max_;
    QuadraticForm F_;  // F0 + t F1 at the best t so far
    double slack_ = 0;
    Contact best_;
};

class ConstraintTree::PointQuery : public Query {
  public:
    using Query::Query;

    void visit_leaf(std::size_t index) {
        const Leaf& leaf = tree().leaves_[index];
        const QuadraticForm& F = form();
        std::array<double, kLeafPoints> value;
        for (std::size_t i = 0; i < kLeafPoints; ++i) {
            value[i] = F(leaf.x[i], leaf.y[i], leaf.z[i]);
        }
        for (std::uint32_t open = at_most(value, slack()); open != 0; open &= open - 1) {
            const std::size_t slot =
                index * kLeafPoints + static_cast<std::size_t>(std::countr_zero(open));
            offer_point(tree().point_order_[std::min(slot, tree().point_order_.size() - 1)]);
        }
    }
};

class ConstraintTree::TriangleQuery : public Query {
  public:
    explicit TriangleQuery(const Query& so_far) : Query(so_far) {}

    void visit_leaf(std::size_t index) {
        const std::size_t end =
            std::min((index + 1) * kLeafTriangles, tree().triangle_order_.size());
        const std::size_t before = tree().constraints_.points.size();
        for (std::size_t slot = index * kLeafTriangles; slot < end; ++slot) {
            offer_triangle(static_cast<std::uint32_t>(before + tree().triangle_order_[slot]));
        }
    }
};

std::optional<Contact> ConstraintTree::first_contact(const QuadraticForm& F0,
                                                     const QuadraticForm& F1, double t_max,
                                                     std::span<const std::uint32_t> guesses) const {
    PointQuery points(*this, F0, F1, t_max);
    for (const std::uint32_t guess : guesses) points.offer(guess);
    point_boxes_.visit(points);
    TriangleQuery triangles(points);
    triangle_boxes_.visit(triangles);
    return triangles.result();
}

}  // namespace ellicast::sender
