// receiver/missed_shape.hpp
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::receiver {

/// Where a mesh between few received vertices misses what the coarse surface shows. The received
/// vertices tell how wrong the coarse surface is: it is believed where it leaves the mesh by more
/// than a multiple of that, of all of it and of what is nearby, so that a crease, which ellipsoids
/// round, is left to the vertices.
class MissedShape {
  public:
    /// `mesh` is what lies between received vertices, `doubts` the distance of each of its vertices
    /// to the coarse surface before that was wrapped, negative for one that was not received;
    /// `concealed` the mesh with what was guessed between them. `mesh` and `doubts` must live as
    /// long. Cost: n log n.
    MissedShape(const common::TriangleMesh& mesh, const std::vector<double>& doubts,
                const common::TriangleMesh& concealed);

    /// At a point of the coarse surface, same frame. Cost: two searches for a closest triangle.
    [[nodiscard]] bool at(const Eigen::Vector3d& point) const;

  private:
    const common::TriangleMesh& mesh_;
    const std::vector<double>& doubts_;
    common::TriangleTree between_;
    common::TriangleTree concealed_;
    double usual_doubt_ = 0;  // root of the mean square, of received vertices
};

}  // namespace ellicast::receiver
