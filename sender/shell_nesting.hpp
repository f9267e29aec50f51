// sender/shell_nesting.hpp: private to sender/model_preparation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// Orients the parts of a closed mesh (edge-connected, each oriented alike within itself): the
/// outermost outward, and with each outermost part all that it encloses as one, so that an inner
/// shell which faces the other way than its surroundings (a cavity) keeps doing so. A part in the
/// void (outside, or in a cavity) always faces outward. Returns how many parts were turned.
/// Enclosed means that most of three points on it are inside. Linear for one part or none that face
/// inward; else by a grid, about linear. Of more than 1024 parts that need the test only the 1024
/// of the largest volume get it; the others count as enclosed by nothing.
struct OrientedParts {
    std::size_t parts = 0;
    std::size_t turned = 0;
    std::size_t flat = 0;  // parts that enclose nothing to speak of
    double volume = 0;     // of all, with sign
};
OrientedParts orient_parts(common::TriangleMesh& mesh,
                           const std::vector<std::uint32_t>& part_of_triangle);

}  // namespace ellicast::sender
