// sender/ellipsoid_selection.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/ellipsoid.hpp"
#include "common/solid_voxels.hpp"

namespace ellicast::sender {

/// What a voxel is worth, in fixed point, so that sums do not depend on their order.
/// Voxel v of the solid has weight w_v; the k-th ellipsoid over it gains w_v p^(k-1) (1 - p), the
/// probability that it arrives and all before it are lost. p = 0 and w = 1 is [BK02] section 3.3.
struct SelectionOptions {
    std::size_t count = 400;
    double loss = 0.0;      // p
    bool thinness = false;  // w_v = reference / max(floor, largest r_min of all candidates over v)
    double thinness_reference = 0.02;  // lengths in the unit of `diagonal`'s share
    double thinness_floor = 0.004;
    double outside = 0.0;   // what a covered voxel outside costs, in units of w = 1, each time
    double tie = 0.01;      // gains within this share of the best count as equal
    double diagonal = 1.0;  // bounding-box diagonal of the model, in its own unit
    unsigned threads = 0;   // does not change the result
};

struct Selection {
    std::vector<std::uint32_t> order;  // indices of candidates, best first
    std::size_t solid = 0;             // voxels of the solid
    std::size_t covered = 0;           // of them, covered by the selection
    std::size_t outside = 0;           // voxels outside the solid covered by the selection
};

/// [BK02] section 3.3: again and again the candidate that gains most. Among those that gain
/// "approximately the same" (options.tie) the one with the smallest minimum radius, then the
/// smaller index. Lazy: gains are upper bounds in a heap, since weights only fall, and are computed
/// anew when they come to the top. Equal to evaluating every candidate in every step. solid: one
/// byte a node of `frame`, non-zero inside. Stops early when nothing gains. Cost: rows of the
/// candidates' shadows; memory 4 bytes a voxel.
Selection select_greedily(std::span<const common::Ellipsoid> candidates,
                          const common::GridFrame& frame, std::span<const std::uint8_t> solid,
                          const SelectionOptions& options);

}  // namespace ellicast::sender
