// sender/triangle_cleaning.hpp: private to sender/model_preparation.
#pragma once

#include <cstddef>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// Only what says something of the shape: every position is used, no two are equal, no triangle has
/// two equal corners and no two have the same three.
struct CleanTriangles {
    common::TriangleMesh mesh;     // positions in the input's order
    std::size_t unreferenced = 0;  // vertices that no triangle used
    std::size_t merged = 0;        // used vertices at the position of an earlier used one
    std::size_t degenerate = 0;    // triangles dropped: equal corners, or no area
    std::size_t duplicate = 0;     // triangles dropped: three corners like another
};

/// Positions merge when equal as numbers (-0 == 0). A triangle without area but with three
/// different corners stays where it seals a seam, that is where each of its edges is shared with
/// exactly one other triangle. Of triangles with the same corners one stays that faces as the
/// majority does; where both faces are equally many they enclose nothing and cancel each other,
/// unless the whole connected part is such a double-faced sheet: then one side of it stays. Throws
/// std::invalid_argument for an index out of range or a used position that is not finite.
CleanTriangles clean_triangles(common::TriangleMesh input);

}  // namespace ellicast::sender
