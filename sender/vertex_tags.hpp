// sender/vertex_tags.hpp
#pragma once

#include <cstdint>
#include <vector>

#include "protocol/datagram.hpp"
#include "sender/model_preparation.hpp"

namespace ellicast::sender {

/// What is sent of a vertex beside its position.
struct TagOptions {
    int normal_bits = 8;  // 0, 8, 12 or 16
    bool ring = false;
    bool colour = true;  // where the model has it
    bool edges = true;   // and edges that a receiver would get wrong (sender/costly_edges.hpp)
};

/// Of no use on the wire: only what the model has.
protocol::RecordFormat record_format(const TagOptions& options, const PreparedModel& model);

/// Fills the tags that the format asks for, but for rings. `record_of` holds for every vertex of
/// the model (and maybe more behind them) the index of its record. What several vertices that
/// became one say is united:
/// - normal: of the sum of the area vectors of the faces around it, seen from outside; marked where
///   `marks` has it, one a vertex of the model or more (common/octahedral_normal.hpp);
/// - colour: that of the first vertex of the model.
/// Deterministic and linear.
void set_tags(const protocol::RecordFormat& format, const PreparedModel& model,
              const std::vector<std::uint32_t>& record_of, const std::vector<char>& marks,
              std::vector<protocol::VertexRecord>& records);

/// Fills the tags of the distinct neighbours along the edges of the faces (common/ring_tag.hpp).
/// `records` are the object's vertices in canonical order, for that is what rings speak of.
/// Deterministic. Cost: a sort of the edges.
void set_rings(const std::vector<common::Triangle>& faces,
               const std::vector<std::uint32_t>& record_of,
               std::vector<protocol::VertexRecord>& records);

}  // namespace ellicast::sender
