// receiver/ellipsoid_mesh.hpp
#pragma once

#include <span>

#include "common/ellipsoid.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::receiver {

/// One closed mesh of 128 triangles for each ellipsoid, a subdivided octahedron: for people to look
/// at
/// ([BK02] figure 7, upper left). Vertices lie on the ellipsoid.
common::TriangleMesh mesh_of(std::span<const common::Ellipsoid> ellipsoids);

}  // namespace ellicast::receiver
