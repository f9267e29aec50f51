// sender/clustered_surface.hpp
#pragma once

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// `mesh` on one vertex for each cube of edge `size` > 0 that holds any: the first one there, in
/// its place. Triangles whose corners come together are left out, as are vertices of none. Within
/// `size` of the surface, which for what is looked at on a scale of some cubes is the same; no
/// topology is kept. Linear.
common::TriangleMesh clustered_surface(const common::TriangleMesh& mesh, double size);

}  // namespace ellicast::sender
