// protocol/vertex_tags.hpp: what a vertex section of a tagged format holds behind its positions;
// WIRE_FORMAT.md section 5.2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/byte_writer.hpp"
#include "protocol/datagram.hpp"

namespace ellicast::protocol {

/// Sets what the format has of the tags of vertices k, k + 1, ... `records` are those of a section
/// of `count` vertices. Requires format.vertex_bytes(count) bytes and k + out.size() <= count.
void load_tags(const RecordFormat& format, std::span<const std::uint8_t> records, std::size_t count,
               std::size_t k, std::span<VertexRecord> out);

/// Whether the bits that fill up the last byte of the tags are all zero. Same requirements.
[[nodiscard]] bool padding_is_zero(const RecordFormat& format,
                                   std::span<const std::uint8_t> records, std::size_t count);

/// Appends the tags of all records: normals and rings as one stream of bits, then colours.
void write_tags(const RecordFormat& format, const Strided<VertexRecord>& records,
                ByteWriter& writer);

}  // namespace ellicast::protocol
