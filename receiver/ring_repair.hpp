// receiver/ring_repair.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "receiver/surface_mesh.hpp"

namespace ellicast::receiver {

/// What the sender said of one vertex's ring (common/ring_tag.hpp).
struct RingWitness {
    std::uint8_t hash = 0;  // of the vertex itself: what it adds to the tags of its neighbours
    std::uint8_t tag = 0;   // of its ring
    bool judged = false;    // the tag is known
};

/// Judged vertices whose ring is, or is not, that of their tag.
struct RingAgreement {
    std::size_t agree = 0;
    std::size_t disagree = 0;
};

/// `witnesses` has one element per vertex slot (asserted).
RingAgreement ring_agreement(const SurfaceMesh& mesh, std::span<const RingWitness> witnesses);

/// Per vertex slot, 1 where a judged vertex's ring is that of its tag, and that of a neighbour too:
/// one alone may agree by chance.
std::vector<char> settled_rings(const SurfaceMesh& mesh, std::span<const RingWitness> witnesses);

/// Flips edges until rings agree with their tags, as far as a bounded search around the wrong ones
/// gets: first every flip that pays at once, then annealing inside each cluster of wrong vertices,
/// of which the best state stays. With `lossy`, where neighbours are missing from some rings, only
/// flips that pay at once in rings and shape together. The mesh stays a closed manifold of the same
/// topology. Deterministic. Cost: linear, and a bounded number of flips per wrong vertex.
/// `witnesses` has one element per vertex slot (asserted).
RingAgreement repair_rings(SurfaceMesh& mesh, std::span<const RingWitness> witnesses,
                           bool lossy = false);

}  // namespace ellicast::receiver
