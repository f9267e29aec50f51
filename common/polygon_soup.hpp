// common/polygon_soup.hpp: private to common/model_io.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// Polygons as a file lists them; nothing is promised of them but indices in range.
struct PolygonSoup {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::uint32_t> corners;  // of all faces, one after the other
    std::vector<std::size_t> ends;       // of face i in `corners`; it begins where i - 1 ends

    [[nodiscard]] std::size_t faces() const { return ends.size(); }
    [[nodiscard]] std::span<const std::uint32_t> face(std::size_t i) const {
        const std::size_t first = i == 0 ? 0 : ends[i - 1];
        return std::span(corners).subspan(first, ends[i] - first);
    }
};

/// Cuts every polygon into a fan from one of its corners: the one whose worst triangle is best
/// (area over summed squared edges, negative when it faces against the polygon's mean normal), the
/// first of equals. Triangles with two equal corners are left out. Linear: of large polygons only
/// 64 corners are tried.
TriangleMesh triangulate(PolygonSoup soup);

}  // namespace ellicast::common
