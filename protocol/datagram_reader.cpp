// protocol/datagram_reader.cpp
#include <algorithm>
#include <optional>
#include <utility>

#include "protocol/acceptance.hpp"
#include "protocol/byte_reader.hpp"
#include "protocol/crc32c.hpp"
#include "protocol/datagram.hpp"
#include "protocol/description.hpp"
#include "protocol/page.hpp"
#include "protocol/vertex_tags.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Fault = std::optional<WireError>;  // empty = nothing wrong

/// What can be said before any field is believed.
Fault check_envelope(Bytes bytes) {
    if (bytes.size() < kHeaderBytes + kTrailerBytes) return WireError::too_short;
    // Version 2 in the top bits; padding, extension and four bits of source count must be zero.
    if (bytes[0] != kRtpVersion << 6) return WireError::not_rtp;
    if (bytes[kVersionOffset] != kWireVersion) return WireError::unknown_version;
    if ((bytes[kFlagsOffset] & ~kFlagApproximate) != 0) return WireError::unsupported_flags;
    const Bytes covered = bytes.first(bytes.size() - kTrailerBytes);
    if (load_u32(bytes.data() + covered.size()) != crc32c(covered)) return WireError::bad_checksum;
    return {};
}

RtpHeader read_rtp(ByteReader& reader) {
    RtpHeader rtp;
    reader.u8();  // checked by check_envelope
    const std::uint8_t marker_and_type = reader.u8();
    rtp.marker = (marker_and_type & 0x80) != 0;
    rtp.payload_type = marker_and_type & 0x7f;
    rtp.sequence = reader.u16();
    rtp.timestamp = reader.u32();
    rtp.ssrc = reader.u32();
    return rtp;
}

Hint read_hint(ByteReader& reader) {
    Hint hint;
    for (float& x : hint.box_min) x = reader.f32();
    for (float& x : hint.box_max) x = reader.f32();
    hint.components = reader.u32();
    hint.euler_all = reader.i32();
    hint.euler_largest = reader.i32();
    hint.ellipsoids = reader.u16();
    hint.vertices = reader.u32();
    const std::uint8_t format = reader.u8();
    hint.format = RecordFormat::of_code(format & 15);
    hint.diagonals = format >> 4 & 7;
    hint.by_importance = (format & 0x80) != 0;
    return hint;
}

/// Requires check_envelope(bytes) to be content, so that every field is there.
DatagramHeader read_header(Bytes bytes) {
    ByteReader reader(bytes.first(kHeaderBytes));
    DatagramHeader header;
    header.rtp = read_rtp(reader);
    reader.u8();  // version
    const std::uint8_t flags = reader.u8();
    std::ranges::copy(reader.bytes(header.session.size()), header.session.begin());
    std::ranges::copy(reader.bytes(header.object.size()), header.object.begin());
    header.hint = read_hint(reader);
    header.hint.approximate = (flags & kFlagApproximate) != 0;
    header.round = reader.u32();
    header.rounds = reader.u32();
    header.ordinal = reader.u32();
    header.datagrams = reader.u32();
    return header;
}

Fault check_header(const DatagramHeader& header) {
    if (!acceptable(header.hint)) return WireError::bad_hint;
    if (header.rounds != 0 && header.round >= header.rounds) return WireError::bad_round;
    if (header.ordinal >= header.datagrams) return WireError::bad_round;
    return {};
}

bool admits_all(const RecordBounds& bounds, const SectionView& section) {
    if (section.kind == SectionKind::ellipsoids) {
        return bounds.admits_ellipsoids(section.body.data(), section.count);
    }
    return bounds.admits_positions(section.body.data(), section.count);
}

/// A section of records: its place in the index space, then the records themselves.
Fault read_records(Bytes body, const Hint& hint, const RecordBounds& bounds, SectionView& section) {
    ByteReader reader(body);
    section.count = reader.u16();
    section.first = reader.u32();
    section.stride = reader.u32();
    section.body = reader.bytes(reader.left());
    section.format = hint.format;
    const bool vertices = section.kind == SectionKind::vertices;
    const std::size_t wanted =
        vertices ? hint.format.vertex_bytes(section.count) : section.count * kEllipsoidBytes;
    if (reader.failed() || section.count == 0 || section.body.size() != wanted) {
        return WireError::bad_section;
    }
    if (vertices && !padding_is_zero(hint.format, section.body, section.count)) {
        return WireError::bad_section;
    }
    const std::uint64_t total = vertices ? hint.vertices : hint.ellipsoids;
    // 64 bits: (2^16 - 1) * (2^32 - 1) + 2^32 - 1 does not overflow.
    const std::uint64_t last = section.first + (section.count - std::uint64_t{1}) * section.stride;
    if (section.stride == 0 || last >= total) return WireError::index_out_of_range;
    if (!admits_all(bounds, section)) return WireError::bad_record;
    return {};
}

/// Edges: between whom they are, then their ends.
Fault read_edges(Bytes body, const Hint& hint, SectionView& section) {
    ByteReader reader(body);
    section.count = reader.u16();
    section.among = reader.u32();
    section.body = reader.bytes(reader.left());
    if (reader.failed() || section.count == 0 ||
        section.body.size() != section.count * kEdgeBytes) {
        return WireError::bad_section;
    }
    if (section.among > hint.vertices) return WireError::index_out_of_range;
    for (std::size_t k = 0; k < section.count; ++k) {
        const EdgeRecord edge = section.edge(k);
        if (edge.a >= edge.b || edge.b >= section.among) return WireError::index_out_of_range;
    }
    return {};
}

Fault read_section(ByteReader& reader, const RecordBounds& bounds, DatagramView& view) {
    const std::uint8_t kind = reader.u8();
    const std::uint16_t length = reader.u16();
    const Bytes body = reader.bytes(length);
    if (reader.failed()) return WireError::bad_section;

    SectionView& section = view.section_storage[view.section_count];
    section.kind = static_cast<SectionKind>(kind);
    switch (section.kind) {
        case SectionKind::ellipsoids:
        case SectionKind::vertices:
            if (const Fault fault = read_records(body, view.header.hint, bounds, section)) {
                return fault;
            }
            break;
        case SectionKind::description:
            if (!is_description(body)) return WireError::bad_description;
            section.body = body;
            break;
        case SectionKind::edges:
            if (const Fault fault = read_edges(body, view.header.hint, section)) return fault;
            break;
        case SectionKind::page:
            if (!is_page(body)) return WireError::bad_description;
            section.body = body;
            break;
        default:
            return {};  // a later version's: skipped, its slot is used by the next one
    }
    ++view.section_count;
    return {};
}

Fault read_sections(Bytes bytes, DatagramView& view) {
    const RecordBounds bounds(view.header.hint);
    ByteReader reader(bytes);
    std::size_t seen = 0;  // unknown kinds included
    while (reader.left() > 0) {
        if (++seen > kMaxSections) return WireError::bad_section;
        if (const Fault fault = read_section(reader, bounds, view)) return fault;
    }
    if (seen == 0) return WireError::bad_section;
    return {};
}

Fault read_datagram(Bytes bytes, DatagramView& view) {
    if (const Fault fault = check_envelope(bytes)) return fault;
    view.header = read_header(bytes);
    if (const Fault fault = check_header(view.header)) return fault;
    const std::size_t section_bytes = bytes.size() - kHeaderBytes - kTrailerBytes;
    return read_sections(bytes.subspan(kHeaderBytes, section_bytes), view);
}

}  // namespace

Result<DatagramView, WireError> parse_datagram(std::span<const std::uint8_t> bytes) {
    Result<DatagramView, WireError> result(std::in_place);
    if (const Fault fault = read_datagram(bytes, *result)) result = *fault;
    return result;
}

}  // namespace ellicast::protocol
