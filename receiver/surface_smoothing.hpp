// receiver/surface_smoothing.hpp
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "receiver/edge_constraints.hpp"
#include "receiver/flip_gains.hpp"
#include "receiver/mesh_regions.hpp"
#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// Flips that lower the sum over all edges of length x (dihedral angle + 0.1 rad): few and gentle
/// creases, and short edges where the surface is flat; and what else a FlipCriterion asks for.
/// Never makes a triangle thinner than the thinner of those it replaces, unless it stays above
/// quality 0.02. Positions must not change, nor the mesh otherwise, while this lives. Memory: 36
/// bytes a face. Requires a mesh without needles of area 0.
class SurfaceSmoother {
  public:
    /// `mesh` must outlive this. Work is done on `threads` threads (0: one per core), which do not
    /// change the result.
    SurfaceSmoother(SurfaceMesh& mesh, unsigned threads);

    /// First single flips to a local minimum, then, unless the criterion says otherwise, pairs of
    /// neighbouring flips: in slot order, and again those that this made doubtful, at most `passes`
    /// times; in the mesh's regions, and then where they meet. Returns the number of flips.
    std::size_t smooth(const FlipCriterion& criterion, int passes = kPasses);
    /// The same of a mesh that smooth() left, by a criterion that has marks beside what it had
    /// then: only what they speak for is looked at, and what follows from it.
    std::size_t smooth_marked(const FlipCriterion& criterion, int passes = kPasses);

    static constexpr int kPasses = 8;

  private:
    template <class IsDoubtful>
    std::size_t sweep_all(const FlipCriterion& criterion, int passes,
                          const IsDoubtful& is_doubtful);
    template <class IsNear, class IsDoubtful, class Attempt>
    std::size_t sweep(int passes, const IsNear& is_near, const IsDoubtful& is_doubtful,
                      const Attempt& attempt);
    template <class IsNear, class Attempt>
    std::size_t sweep_region(std::size_t region, int passes, const IsNear& is_near,
                             const Attempt& attempt);
    template <class Attempt>
    std::size_t sweep_rest(int passes, const Attempt& attempt);

    [[nodiscard]] double least_gain() const;
    [[nodiscard]] double look_ahead() const;
    std::size_t flip_one(HalfedgeId h);
    std::size_t flip_two(HalfedgeId h);
    [[nodiscard]] bool may_pay_with_second(HalfedgeId h, const FlipGains::Trial& first) const;
    [[nodiscard]] std::pair<HalfedgeId, FlipGains::Trial> best_beside(HalfedgeId h,
                                                                      double gain) const;
    void mark(HalfedgeId h, int faces);
    void mark_beyond(HalfedgeId side, int faces);
    [[nodiscard]] bool doubtful(HalfedgeId h);
    void set_doubtful(HalfedgeId h, char value);

    SurfaceMesh& mesh_;
    unsigned threads_;
    MeshRegions regions_;
    FlipGains gains_;
    std::vector<char> doubtful_;  // by half-edge: 0 or 1
};

/// A mesh smoothed by one criterion, on `threads` threads (0: one per core).
std::size_t flip_to_smooth(SurfaceMesh& mesh, const FlipCriterion& criterion = {},
                           int passes = SurfaceSmoother::kPasses, unsigned threads = 0);

}  // namespace ellicast::receiver
