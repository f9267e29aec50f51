// receiver/flip_gains.hpp
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "receiver/edge_constraints.hpp"
#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// What a flip is judged by beside creases; see common/diagonal_choice.hpp.
struct FlipCriterion {
    std::span<const Eigen::Vector3d> normals = {};  // unit, per vertex slot; or none at all
    common::DiagonalWeights weights = {};
    /// Per vertex slot: not 0 where the sender marked it. Empty: nowhere.
    std::span<const char> marks = {};
    /// Per vertex slot: not 0 where the ring must stay as it is. Empty: nowhere.
    std::span<const char> settled = {};
    /// Edges that stay.
    const FixedEdges* fixed = nullptr;
    bool pairs = true;  // flip two at a time as well
};

/// What the two faces of an edge and the edges around it are worth: normals of the faces of h and
/// of its twin t, and length x dihedral angle of h, next(h), prev(h), next(t) and prev(t).
struct QuadCosts {
    std::array<Eigen::Vector3f, 2> normals;  // any positive length
    std::array<float, 5> creases;
};

/// What flips would gain, by DiagonalGain::weighed (common/diagonal_choice.hpp) and marks: the same
/// sum, with faces' normals and edges' creases kept from one question to the next, and in float, to
/// about 1e-6 of the edge lengths. Memory: 24 bytes a face. Requires a mesh without needles of area
/// 0.
class FlipGains {
  public:
    /// Reads all of the mesh once, which must outlive this, on `threads` threads (0: one per core).
    FlipGains(SurfaceMesh& mesh, unsigned threads);
    FlipGains(SurfaceMesh& mesh, const FlipCriterion& criterion) : FlipGains(mesh, 0) {
        judge_by(criterion);
    }

    /// From now on. What the criterion refers to must outlive this, or its next call.
    void judge_by(const FlipCriterion& criterion) { criterion_ = criterion; }

    static constexpr double kAny = -std::numeric_limits<double>::infinity();

    struct Trial {
        double gain = 0;  // a length; minus infinity when the flip is not to be made
        QuadCosts now;
        QuadCosts flipped;  // meaningless when the gain is minus infinity
    };
    /// Of the edge of h. A gain that is not more than `needed` may be told as minus infinity, which
    /// takes less time: 30 to 100 ns. Changes nothing, as all that is const here: many threads may
    /// ask at a time.
    [[nodiscard]] Trial consider(HalfedgeId h, double needed = kAny) const;
    /// The most that flipping h and then one of the four edges around it gains together; as for
    /// consider(), the mesh need not allow it, and what is not more than `needed` may be told as
    /// less. `first` is what consider(h) says, and its gain is finite.
    [[nodiscard]] double best_pair_gain(HalfedgeId h, const Trial& first,
                                        double needed = kAny) const;

    /// Flips, which the mesh must allow; `trial` is what consider(h) says now.
    void flip(HalfedgeId h, const Trial& trial);
    /// Takes back the last flip, of h.
    void undo(HalfedgeId h, const Trial& trial);

    /// Mean edge length of the mesh as it was.
    [[nodiscard]] double unit() const { return unit_; }

  private:
    using Corners = std::array<VertexId, 4>;  // a b c d: edge a -> b, c on its left, d on its right
    // Normals of the faces left and right of ab, and of those beyond bc, ca, ad and db.
    struct Normals {
        std::array<Eigen::Vector3f, 2> now;
        std::array<Eigen::Vector3f, 4> beyond;
    };
    [[nodiscard]] Trial judge_after(HalfedgeId h, const Trial& first, unsigned side,
                                    double needed) const;
    [[nodiscard]] const Eigen::Vector3f& normal_beyond(HalfedgeId h) const {
        return normals_[SurfaceMesh::face_of(mesh_.twin(h))];
    }
    [[nodiscard]] bool settled(const Corners& corners) const;
    // `normals()` is asked for when corners and creases cannot rule the flip out.
    template <class AskNormals>
    [[nodiscard]] Trial judge(const Corners& corners, const std::array<float, 5>& creases,
                              double needed, const AskNormals& normals) const;
    void set_crease(HalfedgeId h, float crease);
    void set(HalfedgeId h, const QuadCosts& costs);

    SurfaceMesh& mesh_;
    FlipCriterion criterion_;
    double unit_;
    std::vector<Eigen::Vector3f> normals_;  // by face slot
    std::vector<float> creases_;            // by half-edge
};

}  // namespace ellicast::receiver
