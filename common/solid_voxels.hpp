// common/solid_voxels.hpp
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// Where the nodes of a regular grid lie: node (i, j, k) at origin + spacing * (i, j, k).
/// Linear index: i + dims[0] * (j + dims[1] * k), x fastest.
struct GridFrame {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    double spacing = 1.0;
    std::array<int, 3> dims{0, 0, 0};

    [[nodiscard]] std::size_t size() const {
        return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
               static_cast<std::size_t>(dims[2]);
    }
    [[nodiscard]] std::size_t index(int i, int j, int k) const {
        return static_cast<std::size_t>(i) +
               static_cast<std::size_t>(dims[0]) *
                   (static_cast<std::size_t>(j) +
                    static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(k));
    }
    [[nodiscard]] Eigen::Vector3d position(int i, int j, int k) const {
        return origin + spacing * Eigen::Vector3d(i, j, k);
    }
};

/// A grid whose longest axis has `cells` cells across the box, with `margin` further cells on every
/// side. Node (margin, margin, margin) is the low corner of the box; shorter axes get as many cells
/// as cover the box, at least one. Requires a non-empty, finite box of positive diagonal, cells >=
/// 1, margin >= 0 (asserted).
GridFrame make_grid_frame(const Eigen::AlignedBox3d& box, int cells, int margin);

/// 1 where the node lies inside the solid (non-zero winding number of a closed mesh), else 0; one
/// byte a node. Crossings along x rows are counted with a consistent rule for rows that meet edges
/// and vertices, so that shared edges count once; a solid holds the nodes on its lower faces and
/// not those on its upper ones, so a cube of n cells on the grid's own lattice has n^3 nodes. Cost:
/// triangles x rows they cover, plus the nodes. Threads do not change the result. Triangles of an
/// open mesh, or of one that is not oriented alike, give streaks along x: mend it first.
std::vector<std::uint8_t> voxelise_solid(const TriangleMesh& mesh, const GridFrame& frame,
                                         unsigned threads = 0);

/// |A and B| / |A or B| of the two solids, counted at the centres of a common grid of cells with
/// `cells` cells along the longest axis of the joint box. 1 when both are empty. Threads do not
/// change the result.
double volume_overlap(const TriangleMesh& a, const TriangleMesh& b, int cells = 256,
                      unsigned threads = 0);

}  // namespace ellicast::common
