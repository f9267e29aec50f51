// sender/broadcast_object.hpp
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/datagram.hpp"
#include "sender/decomposition.hpp"
#include "sender/model_preparation.hpp"
#include "sender/vertex_tags.hpp"

namespace ellicast::sender {

/// What the canonical order of the vertices, and so the order of sending, goes by.
enum class SendingOrder {
    importance,  // what a decimation of the surface removes last comes first
    spread       // every part of the surface alike
};

/// The records of one model in canonical order: what a record's index counts. Function of its
/// inputs alone.
struct BroadcastObject {
    protocol::ObjectId id{};
    protocol::Hint hint;
    protocol::Description description;
    std::vector<protocol::EllipsoidRecord> ellipsoids;  // order of selection
    std::vector<protocol::VertexRecord> vertices;       // in the order of `order`
    std::vector<protocol::EdgeRecord> edges;            // in the order of sending
    SendingOrder order = SendingOrder::importance;
};

struct ObjectOptions {
    std::string name;
    std::uint64_t seed = 1;
    TagOptions tags{};
    SendingOrder order = SendingOrder::importance;
    unsigned threads = 0;  // 0: one per core; does not change the result
};

/// The records of a model's vertices in its own order: what can be said of them before anything is
/// known of ellipsoids and topology.
struct VertexRecords {
    std::array<double, 3> origin{};  // subtracted
    protocol::RecordFormat format;
    std::uint8_t diagonals = 0;  // protocol::Hint::diagonals
    /// By position of the solid; those that are first of their kind have normals and colours.
    std::vector<protocol::VertexRecord> records;
    std::vector<std::uint32_t> first_equal;  // of each record the first with the same position
};

/// Subtracts the origin (zero unless the box lies far from it; chosen so that float32 input
/// survives bit for bit), rounds to float32, and finds tags and rule for diagonals. Throws
/// std::invalid_argument with a one-line reason for coordinates beyond float32.
VertexRecords vertex_records(const PreparedModel& model, const ObjectOptions& options);

/// Turns geometry into records: of the vertex_records() merges those that became equal, orders them
/// (removal_order() backwards and spread_within_strata(), or spread_order()), finds the
/// costly_edges() (by importance: of every stratum of at least 512 vertices too, on models of at
/// most 2^18), drops ellipsoids that no receiver would accept, fills hint, id and description. The
/// hinted box is that of the rounded records. The model is used up on the way, so that a large one
/// is not there twice. Throws std::invalid_argument with a one-line reason when no vertex or no
/// ellipsoid remains, or when size, counts or topology exceed what the wire can say.
BroadcastObject make_object(PreparedModel model, VertexRecords vertices,
                            const ShapePromise& promise, const Decomposition& decomposition,
                            const ObjectOptions& options);
/// The same, with the vertex_records() made first.
BroadcastObject make_object(PreparedModel model, const ShapePromise& promise,
                            const Decomposition& decomposition, const ObjectOptions& options);

}  // namespace ellicast::sender
