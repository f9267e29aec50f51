// tests/support/datagrams.hpp: made objects and the valid datagrams that carry them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/datagram.hpp"

namespace ellicast::tests {

using Datagram = std::vector<std::uint8_t>;

/// What a sender would send, without any geometry behind it.
struct MadeObject {
    protocol::ObjectId id{};
    protocol::Hint hint;
    protocol::Description description;
    std::vector<protocol::EllipsoidRecord> ellipsoids;
    std::vector<protocol::VertexRecord> vertices;
};

/// A unit sphere at the origin: distinct vertices on it in a seeded order, and nearly spherical
/// ellipsoids that fill it, each slightly different. The id is true.
MadeObject made_sphere(std::uint32_t vertices, std::uint16_t ellipsoids, std::uint64_t seed = 1);

/// Gives every vertex seeded tags of this format, and makes the id true.
void add_tags(MadeObject& object, const protocol::RecordFormat& format, std::uint64_t seed = 1);

/// Makes the id true again after a change of hint or records.
void identify(MadeObject& object);

/// One sender instance.
struct MadeStream {
    protocol::SessionId session{1, 2, 3, 4, 5, 6, 7, 8};
    std::uint32_t ssrc = 0x11223344;
    std::uint16_t first_sequence = 65'500;  // so that every test sees a wrap-around
    std::uint32_t first_timestamp = 4'294'960'000u;
    std::uint32_t timestamp_step = 90;  // one millisecond
    std::uint32_t rounds = 1;           // as the header says; 0 = forever
    std::size_t datagram_bytes = 1200;
    bool describe = true;
};

/// The datagrams of the first `rounds` rounds (of stream.rounds when that is not 0), each with
/// every record once: description and ellipsoids first, then vertices, strided.
std::vector<Datagram> made_datagrams(const MadeObject& object, const MadeStream& stream = {},
                                     std::uint32_t rounds = 1);

/// A datagram that holds one given section of vertices or ellipsoids; for contradictions.
Datagram made_datagram(const protocol::DatagramHeader& header, std::uint32_t first,
                       const std::vector<protocol::VertexRecord>& vertices);
Datagram made_datagram(const protocol::DatagramHeader& header, std::uint32_t first,
                       const std::vector<protocol::EllipsoidRecord>& ellipsoids);
Datagram made_datagram(const protocol::DatagramHeader& header,
                       const protocol::Description& description);

/// The header that made_datagrams puts on the first datagram.
protocol::DatagramHeader made_header(const MadeObject& object, const MadeStream& stream = {});

}  // namespace ellicast::tests
