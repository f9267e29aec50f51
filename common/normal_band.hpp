// common/normal_band.hpp
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/distance_grid.hpp"

namespace ellicast::common {

/// What oriented points say of a field around them: the mean of n.(x - p) over the points within
/// 2.5 spacings of node x, weighted by about the inverse fourth power of their distance (signed
/// distance to tangent planes, as in [HDDMS92], with the weights of moving least squares).
/// `spacing`, a length, is the usual distance between neighbouring points; `normals` are of unit
/// length, one a point (asserted). Made once for all fields on `frame`. Points are added in their
/// order: deterministic. Cost: the nodes in all balls of 2.5 spacings; memory: 8 bytes a node.
class NormalBand {
  public:
    NormalBand(std::span<const Eigen::Vector3d> points, std::span<const Eigen::Vector3d> normals,
               double spacing, const GridFrame& frame);

    /// Puts it in the place of the field's values within 0.75 spacings of a point, leaves them as
    /// they are further than 1.75 spacings from all points, and passes from one to the other in
    /// between. The grid must be the frame's (asserted). Linear in the nodes.
    void blend_into(DistanceGrid& grid) const;

  private:
    std::vector<float> value_;  // a length
    std::vector<float> share_;  // 0 to 1
};

}  // namespace ellicast::common
