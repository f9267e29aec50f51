// protocol/object_table.hpp
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/datagram.hpp"

namespace ellicast::protocol {

/// Feeds the bytes that an object's id is a digest of (DESIGN section 5, "Object id") to `sink`, a
/// callable that takes std::span<const std::uint8_t>: the canonical hint, in which the record
/// format stands, then every ellipsoid and every vertex record in index order, each in its
/// big-endian canonical form (WIRE_FORMAT.md section 7): of a vertex the position and the tags of
/// the hint's format. How the bytes are cut into calls means nothing. Linear in the records; no
/// allocation.
template <class Sink>
void feed_object_table(const Hint& hint, std::span<const EllipsoidRecord> ellipsoids,
                       std::span<const VertexRecord> vertices, Sink&& sink) {
    sink(std::span<const std::uint8_t>(canonical_bytes(hint)));

    std::array<std::uint8_t, 64 * kEllipsoidBytes> chunk;  // few calls: each has a cost of its own
    std::size_t used = 0;
    const auto flush = [&] {
        sink(std::span<const std::uint8_t>(chunk.data(), used));
        used = 0;
    };
    const auto make_room = [&] {
        if (used + kEllipsoidBytes > chunk.size()) flush();  // a vertex takes less
    };
    const auto put = [&](std::uint32_t bits, int bytes) {
        for (int shift = 8 * bytes - 8; shift >= 0; shift -= 8) {
            chunk[used++] = static_cast<std::uint8_t>(bits >> shift);
        }
    };
    for (const EllipsoidRecord& record : ellipsoids) {
        make_room();
        for (const float x : record.scalars) put(std::bit_cast<std::uint32_t>(x), 4);
    }
    for (const VertexRecord& record : vertices) {
        make_room();
        for (const float x : record.position) put(std::bit_cast<std::uint32_t>(x), 4);
        if (hint.format.normal_bits > 0) put(record.normal, 2);
        if (hint.format.ring) put(record.ring, 1);
        if (hint.format.colour) {
            for (const std::uint8_t channel : record.colour) put(channel, 1);
        }
    }
    flush();
}

/// The id of the object with these records. `Hasher` is common::Digest at both ends, or anything
/// with update(span) and finish8(); protocol itself knows no digest.
template <class Hasher>
ObjectId object_id_of(const Hint& hint, std::span<const EllipsoidRecord> ellipsoids,
                      std::span<const VertexRecord> vertices) {
    Hasher hasher;
    feed_object_table(hint, ellipsoids, vertices,
                      [&](std::span<const std::uint8_t> bytes) { hasher.update(bytes); });
    return hasher.finish8();
}

}  // namespace ellicast::protocol
