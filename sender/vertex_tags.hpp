// sender/vertex_tags.hpp
#pragma once

#include <vector>

#include "protocol/datagram.hpp"
#include "sender/model_preparation.hpp"

namespace ellicast::sender {

/// What is sent of a vertex beside its position.
struct TagOptions {
    int normal_bits = 8;  // 0, 8, 12 or 16
    bool ring = false;
    bool colour = true;  // where the model has it
};

/// Of no use on the wire: only what the model has.
protocol::RecordFormat record_format(const TagOptions& options, const PreparedModel& model);

/// Fills the tags that the format asks for. `records` are the object's vertices in canonical order,
/// distinct in position; `of_vertex` holds for every vertex of the model its position as a record,
/// which must be among them (asserted). What several vertices that became one say is united:
/// - normal: of the sum of the area vectors of the faces around it, seen from outside; code 0 where
///   that is nothing (common/octahedral_normal.hpp);
/// - ring: of its distinct neighbours along the model's edges (common/ring_tag.hpp);
/// - colour: that of the first vertex of the model.
/// Deterministic. Cost: that of a sort.
void set_tags(const protocol::RecordFormat& format, const PreparedModel& model,
              const std::vector<protocol::VertexRecord>& of_vertex,
              std::vector<protocol::VertexRecord>& records);

}  // namespace ellicast::sender
