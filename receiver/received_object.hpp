// receiver/received_object.hpp
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/datagram.hpp"

namespace ellicast::receiver {

/// What arrived of one object: distinct records in index order. A value; the reconstruction is a
/// function of it and of its options alone.
struct ReceivedObject {
    protocol::ObjectId id{};
    protocol::Hint hint;
    std::optional<protocol::Description> description;
    std::vector<std::uint32_t> ellipsoid_index;  // ascending
    std::vector<protocol::EllipsoidRecord> ellipsoids;
    std::vector<std::uint32_t> vertex_index;  // ascending
    std::vector<protocol::VertexRecord> vertices;
    std::vector<protocol::EdgeRecord> edges;  // ascending; advice
};

/// Every record that the hint announces is there.
bool is_complete(const ReceivedObject& object);

/// The object is complete and its records are those that its id was made of. Linear in the records.
bool id_matches(const ReceivedObject& object);

}  // namespace ellicast::receiver
