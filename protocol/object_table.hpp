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
/// format stands, then every ellipsoid and every vertex record in index order, each as its raw
/// big-endian wire form. How the bytes are cut into calls means nothing. Linear in the records; no
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
    const auto put = [&](std::span<const float> scalars) {
        if (used + 4 * scalars.size() > chunk.size()) flush();
        for (const float scalar : scalars) {
            const auto bits = std::bit_cast<std::uint32_t>(scalar);
            for (int shift = 24; shift >= 0; shift -= 8) {
                chunk[used++] = static_cast<std::uint8_t>(bits >> shift);
            }
        }
    };
    for (const EllipsoidRecord& record : ellipsoids) put(record.scalars);
    for (const VertexRecord& record : vertices) put(record.position);
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
