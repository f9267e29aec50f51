// tests/support/large_model.hpp: models of any size, with detail down to their edges.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/triangle_mesh.hpp"

namespace ellicast::tests {

/// `model` with exactly `vertices` vertices: its longest edges are split, all of them in a round as
/// long as that is not too many, new vertices where Loop's rule puts them. Then every vertex moves
/// along its normal by seeded smooth noise: octaves from a 32nd of the bounding box's diagonal to
/// four mean edges, their amplitude falling with the wavelength. Genus and components are those of
/// `model`. Same arguments, same bits. Linear in time and memory. Throws std::invalid_argument
/// where the model is not closed, orientable and manifold along its edges, or has more vertices
/// already.
common::TriangleMesh large_model(common::TriangleMesh model, std::size_t vertices,
                                 std::uint64_t seed);

}  // namespace ellicast::tests
