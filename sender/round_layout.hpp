// sender/round_layout.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/datagram.hpp"

namespace ellicast::sender {

/// What a layout depends on. Sizes in bytes.
struct LayoutSizes {
    std::size_t payload = 0;                 // of one datagram: what its sections may take
    std::size_t description = 0;             // of the description's section
    std::uint32_t description_interval = 1;  // datagrams from one description to the next
    std::uint32_t ellipsoids = 0;
    std::uint32_t vertices = 0;
    protocol::RecordFormat format;    // of the vertices
    std::size_t copies = 1;           // of every ellipsoid, at least; 1: exactly once
    std::size_t vertex_sections = 1;  // of one datagram: headers to leave room for
    std::size_t edges = 0;            // of the largest section of edges, header and all; 0: none
    std::uint32_t edge_sections = 0;  // in a round
    double redundancy = 1.0;          // bytes of a round, in rounds that hold each vertex once
};

/// A run of ellipsoid indices first, first + stride, ...
struct EllipsoidRun {
    std::uint32_t first = 0;
    std::uint32_t stride = 1;
    std::uint32_t count = 0;
};

/// Who carries which records: the part of a round that does not depend on its number. Datagrams
/// 0 .. head-1 carry the first copy of all ellipsoids; in the `body` that follows, further copies
/// ride along as sections at even distances. Vertices fill what room is left, by position in the
/// round's order.
struct RoundLayout {
    std::uint32_t ellipsoids = 0;
    std::uint32_t head = 0;
    std::uint32_t body = 0;
    std::uint32_t edge_sections = 0;
    std::vector<std::uint32_t>
        groups;  // of each further copy: its section j is the class j mod groups
    std::vector<std::uint32_t> first_group;  // running sums of groups; groups.size() + 1 values
    // Running sums of vertices, copies included; datagrams() + 1 values.
    std::vector<std::uint32_t> first_vertex;

    [[nodiscard]] std::uint32_t datagrams() const { return head + body; }
    [[nodiscard]] std::uint32_t sections() const { return first_group.back(); }

    /// Which of the sections of edges is in datagram `ordinal`: they stand at even distances in the
    /// body.
    [[nodiscard]] std::optional<std::uint32_t> edges_at(std::uint32_t ordinal) const;

    /// The ellipsoids in datagram `ordinal` of a round whose sections are rotated by `rotation`
    /// places.
    [[nodiscard]] std::optional<EllipsoidRun> ellipsoids_at(std::uint32_t ordinal,
                                                            std::uint32_t rotation) const;
};

/// The shortest round that holds everything, up to a few datagrams, with a section of ellipsoids in
/// at least every 8th datagram of the body and no datagram empty. Every copy divides the ellipsoids
/// into another number of classes, without a common divisor as far as that goes, so that two
/// ellipsoids that are lost together in one copy are not in the next. A redundancy above 1 adds
/// positions for copies of vertices (and a section header in each datagram) until the bytes of the
/// round, within one datagram, are that many times those of the round without, or there are 12
/// positions a vertex; then no datagram holds more of them than there are vertices. Requires
/// ellipsoids, vertices, copies, vertex_sections and description_interval >= 1, and room for a
/// description, an ellipsoid and a vertex with their section headers in the payload (asserted).
/// Cost: about linear in the number of datagrams.
RoundLayout lay_out(const LayoutSizes& sizes);

}  // namespace ellicast::sender
