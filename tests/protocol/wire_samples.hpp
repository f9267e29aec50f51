// tests/protocol/wire_samples.hpp: datagrams to take apart, and tools to damage them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/random.hpp"
#include "protocol/datagram.hpp"

namespace ellicast::tests {

using Bytes = std::vector<std::uint8_t>;

/// "0a ff" -> {0x0a, 0xff}; blanks between bytes.
Bytes from_hex(std::string_view hex);

/// A header whose every field differs from its default: box [-1,1] x [-2,2] x [-0.5,4], 400
/// ellipsoids, 50 000 vertices, genus 3.
protocol::DatagramHeader sample_header();
protocol::Description sample_description();

/// Records that the hint accepts, with the tags of its format.
protocol::VertexRecord random_vertex(const protocol::Hint& hint, common::Random& random);
protocol::EllipsoidRecord random_ellipsoid(const protocol::Hint& hint, common::Random& random);
std::vector<protocol::VertexRecord> random_vertices(std::size_t count, const protocol::Hint& hint,
                                                    common::Random& random);
std::vector<protocol::EllipsoidRecord> random_ellipsoids(std::size_t count,
                                                         const protocol::Hint& hint,
                                                         common::Random& random);

/// Between any of the vertices; requires two of them.
std::vector<protocol::EdgeRecord> random_edges(std::size_t count, const protocol::Hint& hint,
                                               common::Random& random);

/// The sample's header with another record format.
protocol::DatagramHeader sample_header(const protocol::RecordFormat& format);

/// A full datagram of kDefaultDatagramBytes: description, 10 ellipsoids from index 5 by 17, then
/// vertices from index 11 by 523 as many as fit.
Bytes sample_datagram(std::uint64_t seed = 1);

/// Any datagram that a sender may make: random header, hint, sections and capacity.
struct RandomDatagram {
    protocol::DatagramHeader header;
    struct Section {
        protocol::SectionKind kind{};
        std::uint32_t first = 0;
        std::uint32_t stride = 1;
        std::vector<protocol::EllipsoidRecord> ellipsoids;
        std::vector<protocol::VertexRecord> vertices;
        protocol::Description description;
        protocol::PageEntry page;
        std::vector<protocol::EdgeRecord> edges;
    };
    std::vector<Section> sections;
    std::size_t capacity = 0;
    Bytes bytes;
};
RandomDatagram random_datagram(std::uint64_t seed);

/// Makes the trailer right again after damage before it. Leaves less than a trailer alone.
void fix_checksum(Bytes& datagram);

/// The sample's header bytes, then these sections as they are, then the right checksum.
Bytes datagram_with(std::span<const std::uint8_t> sections,
                    const protocol::DatagramHeader& header = sample_header());

/// Big-endian bytes, for sections made by hand.
void put_u8(Bytes& bytes, std::uint8_t value);
void put_u16(Bytes& bytes, std::uint16_t value);
void put_u32(Bytes& bytes, std::uint32_t value);
void put_f32(Bytes& bytes, float value);
void put_f64(Bytes& bytes, double value);

/// Why the parser refuses the bytes, nothing if it does not. They are put into a heap buffer of
/// exactly their size, so that the address sanitizer sees one byte read too far.
std::optional<protocol::WireError> refusal_of(std::span<const std::uint8_t> bytes);

}  // namespace ellicast::tests
