// sender/broadcast_object.hpp
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/datagram.hpp"
#include "sender/decomposition.hpp"
#include "sender/model_preparation.hpp"
#include "sender/vertex_tags.hpp"

namespace ellicast::sender {

/// The records of one model in canonical order: what a record's index counts. Function of its
/// inputs alone.
struct BroadcastObject {
    protocol::ObjectId id{};
    protocol::Hint hint;
    protocol::Description description;
    std::vector<protocol::EllipsoidRecord> ellipsoids;  // order of selection
    std::vector<protocol::VertexRecord> vertices;       // spatially spread, seeded order
};

struct ObjectOptions {
    std::string name;
    std::uint64_t seed = 1;
    TagOptions tags{};
};

/// Turns geometry into records: subtracts the origin (zero unless the box lies far from it; chosen
/// so that float32 input survives bit for bit), rounds to float32, merges vertices that become
/// equal, orders the vertices, gives them their tags, drops ellipsoids that no receiver would
/// accept, fills hint, id and description. The hinted box is that of the rounded records. Throws
/// std::invalid_argument with a one-line reason when no vertex or no ellipsoid remains, or when
/// size, counts or topology exceed what the wire can say.
BroadcastObject make_object(const PreparedModel& model, const ShapePromise& promise,
                            const Decomposition& decomposition, const ObjectOptions& options);

/// Seeded stratified order: the k-th prefix of any length is an even sample of the surface. Ranks
/// along a Morton curve are visited in bit-reversed order, shuffled inside strata by the seed. Any
/// 2^d visits that follow each other at an odd stride and begin at a multiple of 2^d strides lie in
/// 2^d different parts of the curve. Returns a permutation of 0..n-1. Cost: n log n. Requires
/// finite positions.
std::vector<std::uint32_t> spread_order(const std::vector<Eigen::Vector3d>& positions,
                                        std::uint64_t seed);

}  // namespace ellicast::sender
