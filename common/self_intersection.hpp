// common/self_intersection.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/face_boxes.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// Number of unordered pairs of triangles that share no vertex (by index) and intersect or touch,
/// and the number of triangles in such pairs. Overlaps in one plane count. Exact
/// (triangles_meet()), degenerate triangles included. Linear for surfaces, by a tree of boxes.
/// Threads do not change the result.
struct SelfIntersections {
    std::size_t pairs = 0;
    std::size_t faces = 0;
};
SelfIntersections count_self_intersections(const TriangleMesh& mesh, unsigned threads = 0);

/// The triangles in such pairs, ascending.
std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh, unsigned threads = 0);

/// The same for a mesh whose vertices move between questions.
class IntersectionSearch {
  public:
    /// The mesh must outlive this, and keep its faces.
    explicit IntersectionSearch(const TriangleMesh& mesh) : mesh_(mesh), boxes_(mesh) {}

    /// Vertices were moved. Linear.
    void refit() { boxes_.refit(mesh_); }

    [[nodiscard]] std::vector<std::uint32_t> faces(unsigned threads) const;
    /// Those in pairs with at least one of `suspects`, which are ascending. Cost: a search for each
    /// suspect.
    [[nodiscard]] std::vector<std::uint32_t> faces_with(std::span<const std::uint32_t> suspects,
                                                        unsigned threads) const;

  private:
    const TriangleMesh& mesh_;
    FaceBoxes boxes_;
};

}  // namespace ellicast::common
