// tests/protocol/golden_datagram.hpp
#pragma once

#include "protocol/datagram.hpp"

namespace ellicast::tests {

/// One datagram of version 1 with a section of every kind, field by field in the order of
/// WIRE_FORMAT.md. Worked out apart from the codec. It changes only together with the version.
inline constexpr const char* kGoldenHex =
    // clang-format off
    "80 "  // RTP version 2, no padding, extension or sources
    "e0 "  // marker, payload type 96
    "ff fe "  // sequence
    "01 02 03 04 "  // timestamp
    "de ad be ef "  // SSRC
    "01 "  // version
    "01 "  // flags: approximate
    "10 11 12 13 14 15 16 17 "  // session
    "a0 a1 a2 a3 a4 a5 a6 a7 "  // object
    "bf 80 00 00 c0 00 00 00 bf 00 00 00 "  // box, least corner: -1 -2 -0.5
    "3f 80 00 00 40 00 00 00 40 80 00 00 "  // box, greatest corner: 1 2 4
    "00 00 00 02 "  // components
    "ff ff ff fc "  // Euler characteristic, all
    "ff ff ff fa "  // of the largest component
    "01 90 "  // ellipsoids
    "00 00 bd 65 "  // vertices
    "00 "  // record format
    "00 00 00 03 "  // round
    "00 00 00 05 "  // rounds
    "00 00 02 7f "  // ordinal
    "00 00 02 80 "  // datagrams
    "03 "  // description
    "00 28 "  // length
    "3f e0 00 00 00 00 00 00 c0 90 00 00 "  // origin: 0.5 -1024 3
    "00 00 00 00 40 08 00 00 00 00 00 00 "
    "05 68 6f 72 73 65 "  // name
    "02 6d 6d "  // unit
    "00 "  // certificate
    "05 30 2e 31 2e 30 "  // sender version
    "01 "  // ellipsoids
    "00 2e "  // length
    "00 01 "  // count
    "00 00 01 8f "  // first
    "00 00 00 01 "  // stride
    "3e 80 00 00 bf c0 00 00 40 00 00 00 "  // centre: 0.25 -1.5 2
    "3f 00 00 00 3e 00 00 00 3f 40 00 00 "  // L: 0.5 | 0.125 0.75 | -0.25 0 1
    "be 80 00 00 00 00 00 00 3f 80 00 00 "
    "02 "  // vertices
    "00 22 "  // length
    "00 02 "  // count
    "00 00 00 07 "  // first
    "00 00 03 fd "  // stride
    "3f 80 00 00 c0 00 00 00 40 80 00 00 "  // vertex 7: 1 -2 4
    "bf 80 00 00 3d cc cc cd 40 50 00 00 "  // vertex 1028: -1 0.1 3.25
    "c7 5f 05 47";  // CRC-32C
// clang-format on

/// One of tagged vertices under the same header but for the record format.
inline constexpr const char* kGoldenTaggedHex =
    // clang-format off
    "80 "  // RTP version 2, no padding, extension or sources
    "e0 "  // marker, payload type 96
    "ff fe "  // sequence
    "01 02 03 04 "  // timestamp
    "de ad be ef "  // SSRC
    "01 "  // version
    "01 "  // flags: approximate
    "10 11 12 13 14 15 16 17 "  // session
    "a0 a1 a2 a3 a4 a5 a6 a7 "  // object
    "bf 80 00 00 c0 00 00 00 bf 00 00 00 "  // box, least corner: -1 -2 -0.5
    "3f 80 00 00 40 00 00 00 40 80 00 00 "  // box, greatest corner: 1 2 4
    "00 00 00 02 "  // components
    "ff ff ff fc "  // Euler characteristic, all
    "ff ff ff fa "  // of the largest component
    "01 90 "  // ellipsoids
    "00 00 bd 65 "  // vertices
    "0e "  // record format: normals of 12 bits, ring, colour
    "00 00 00 03 "  // round
    "00 00 00 05 "  // rounds
    "00 00 02 7f "  // ordinal
    "00 00 02 80 "  // datagrams
    "02 "  // vertices
    "00 3f "  // length
    "00 03 "  // count
    "00 00 00 00 "  // first
    "00 00 00 01 "  // stride
    "3f 80 00 00 c0 00 00 00 40 80 00 00 "  // position 0: 1 -2 4
    "bf 80 00 00 3d cc cc cd 40 50 00 00 "  // position 1: -1 0.1 3.25
    "00 00 00 00 3f 80 00 00 3f 00 00 00 "  // position 2: 0 1 0.5
    "ab c5 e1 23 07 ff f0 00 "  // abc 5e, 123 07, fff 00, 0: normals and rings, filled up
    "ff 80 00 00 00 00 01 02 03 "  // colours
    "39 60 42 92";  // CRC-32C
// clang-format on

/// What those bytes say.
inline protocol::DatagramHeader golden_header() {
    protocol::DatagramHeader header;
    header.rtp = {true, 96, 0xfffe, 0x01020304, 0xdeadbeef};
    header.session = {0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17};
    header.object = {0xa0, 0xa1, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7};
    header.hint.box_min = {-1.0f, -2.0f, -0.5f};
    header.hint.box_max = {1.0f, 2.0f, 4.0f};
    header.hint.components = 2;
    header.hint.euler_all = -4;
    header.hint.euler_largest = -6;
    header.hint.ellipsoids = 400;
    header.hint.vertices = 48'485;
    header.hint.approximate = true;
    header.round = 3;
    header.rounds = 5;
    header.ordinal = 639;
    header.datagrams = 640;
    return header;
}

inline protocol::Description golden_description() {
    return {"horse", {0.5, -1024.0, 3.0}, "mm", "", "0.1.0"};
}

/// A whole section: page 1 of 3, version 2.
inline constexpr const char* kGoldenPageHex =
    // clang-format off
    "04 "  // page
    "00 24 "  // length
    "00 01 "  // page
    "00 03 "  // pages
    "00 00 00 02 "  // version
    "a0 a1 a2 a3 a4 a5 a6 a7 "  // object
    "00 00 00 02 "  // components
    "ff ff ff fc "  // Euler characteristic, all
    "01 90 "  // ellipsoids
    "00 00 bd 65 "  // vertices
    "05 68 6f 72 73 65 ";  // name
// clang-format on

inline protocol::PageEntry golden_page() {
    protocol::PageEntry entry;
    entry.page = 1;
    entry.pages = 3;
    entry.version = 2;
    entry.object = {0xa0, 0xa1, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7};
    entry.components = 2;
    entry.euler_all = -4;
    entry.ellipsoids = 400;
    entry.vertices = 48485;
    entry.name = "horse";
    return entry;
}

/// A whole section: two edges of what is left of 48485 vertices when half of them are gone.
inline constexpr const char* kGoldenEdgesHex =
    // clang-format off
    "05 "  // edges
    "00 16 "  // length: 22 = 6 + 2 * 8
    "00 02 "  // count
    "00 00 5e b3 "  // among: 24243
    "00 00 00 07 " "00 00 04 04 "
    "00 00 00 00 " "00 00 5e b2 ";
// clang-format on

/// Index 399.
inline protocol::EllipsoidRecord golden_ellipsoid() {
    return {{0.25f, -1.5f, 2.0f, 0.5f, 0.125f, 0.75f, -0.25f, 0.0f, 1.0f}};
}

/// Indices 7 and 7 + 1021.
inline std::vector<protocol::VertexRecord> golden_vertices() {
    return {{{1.0f, -2.0f, 4.0f}}, {{-1.0f, 0.1f, 3.25f}}};
}

inline protocol::DatagramHeader golden_tagged_header() {
    protocol::DatagramHeader header = golden_header();
    header.hint.format = {.normal_bits = 12, .ring = true, .colour = true};
    return header;
}

/// Indices 0, 1, 2.
inline std::vector<protocol::VertexRecord> golden_tagged_vertices() {
    return {{{1.0f, -2.0f, 4.0f}, 0xabc, 0x5e, {0xff, 0x80, 0}},
            {{-1.0f, 0.1f, 3.25f}, 0x123, 0x07, {0, 0, 0}},
            {{0.0f, 1.0f, 0.5f}, 0xfff, 0, {1, 2, 3}}};
}

}  // namespace ellicast::tests
