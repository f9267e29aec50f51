// protocol/datagram_writer.cpp
#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <utility>

#include "protocol/byte_writer.hpp"
#include "protocol/crc32c.hpp"
#include "protocol/datagram.hpp"
#include "protocol/description.hpp"
#include "protocol/page.hpp"
#include "protocol/vertex_tags.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {
namespace {

void write_rtp(ByteWriter& writer, const RtpHeader& rtp) {
    assert(rtp.payload_type < 0x80);
    writer.u8(kRtpVersion << 6);
    writer.u8(static_cast<std::uint8_t>((rtp.marker ? 0x80 : 0) | (rtp.payload_type & 0x7f)));
    writer.u16(rtp.sequence);
    writer.u32(rtp.timestamp);
    writer.u32(rtp.ssrc);
}

template <class Writer>
void write_hint(Writer& writer, const Hint& hint) {
    for (const float x : hint.box_min) writer.f32(x);
    for (const float x : hint.box_max) writer.f32(x);
    writer.u32(hint.components);
    writer.i32(hint.euler_all);
    writer.i32(hint.euler_largest);
    writer.u16(hint.ellipsoids);
    writer.u32(hint.vertices);
    writer.u8(static_cast<std::uint8_t>(hint.format.code() | hint.diagonals << 4 |
                                        (hint.by_importance ? 0x80 : 0)));
}

void write_header(ByteWriter& writer, const DatagramHeader& header) {
    write_rtp(writer, header.rtp);
    writer.u8(kWireVersion);
    writer.u8(header.hint.approximate ? kFlagApproximate : 0);
    writer.bytes(header.session);
    writer.bytes(header.object);
    write_hint(writer, header.hint);
    writer.u32(header.round);
    writer.u32(header.rounds);
    writer.u32(header.ordinal);
    writer.u32(header.datagrams);
}

// Records of later rounds lie a stride apart, each in a cache line of its own where no processor
// looks for it: this many are asked for beforehand, those of the next datagram too.
constexpr std::size_t kAhead = 24;

template <std::size_t N>
std::uint8_t* store_floats(std::uint8_t* out, const std::array<float, N>& values) {
    for (std::size_t k = 0; k < N; ++k) {
        store_u32(out + 4 * k, std::bit_cast<std::uint32_t>(values[k]));
    }
    return out + 4 * N;
}

/// In front of the records: `bytes` is what they take.
void write_section_header(ByteWriter& writer, SectionKind kind, std::uint32_t first,
                          std::uint32_t stride, std::size_t count, std::size_t bytes) {
    writer.u8(static_cast<std::uint8_t>(kind));
    writer.u16(static_cast<std::uint16_t>(kIndexBytes + bytes));
    writer.u16(static_cast<std::uint16_t>(count));
    writer.u32(first);
    writer.u32(stride);
}

}  // namespace

std::array<std::uint8_t, kCanonicalHintBytes> canonical_bytes(const Hint& hint) {
    std::array<std::uint8_t, kCanonicalHintBytes> out{};
    FixedWriter writer(out);
    write_hint(writer, hint);
    writer.u8(hint.approximate ? 1 : 0);
    assert(writer.left() == 0);
    return out;
}

DatagramWriter::DatagramWriter(const DatagramHeader& header, std::size_t capacity,
                               std::vector<std::uint8_t> spent)
    : bytes_(std::move(spent)), format_(header.hint.format), capacity_(capacity) {
    assert(capacity >= kLeastCapacity && capacity <= kMaxDatagramBytes);
    bytes_.clear();
    bytes_.reserve(capacity);
    ByteWriter writer(bytes_);
    write_header(writer, header);
    assert(bytes_.size() == kHeaderBytes);
}

std::size_t DatagramWriter::free_bytes() const {
    return capacity_ - kTrailerBytes - bytes_.size();
}

std::size_t DatagramWriter::record_room() const {
    if (sections_ == kMaxSections || free_bytes() < kSectionHeaderBytes) return 0;
    return std::min<std::size_t>(free_bytes() - kKindAndLengthBytes, 0xffff) - kIndexBytes;
}

std::size_t DatagramWriter::ellipsoids_that_fit() const {
    return record_room() / kEllipsoidBytes;
}

std::size_t DatagramWriter::vertices_that_fit() const {
    return format_.vertices_within(record_room());
}

std::size_t DatagramWriter::edges_that_fit() const {
    if (sections_ == kMaxSections || free_bytes() < kEdgeSectionBytes) return 0;
    return (std::min<std::size_t>(free_bytes(), 0xffff) - kEdgeSectionBytes) / kEdgeBytes;
}

void DatagramWriter::add_ellipsoids(std::uint32_t first, std::uint32_t stride,
                                    const Strided<EllipsoidRecord>& records) {
    assert(!records.empty() && records.size() <= ellipsoids_that_fit());
    ByteWriter writer(bytes_);
    write_section_header(writer, SectionKind::ellipsoids, first, stride, records.size(),
                         records.size() * kEllipsoidBytes);
    std::uint8_t* out = writer.grow(records.size() * kEllipsoidBytes);
    for (std::size_t k = 0; k < records.size(); ++k) out = store_floats(out, records[k].scalars);
    ++sections_;
}

void DatagramWriter::add_vertices(std::uint32_t first, std::uint32_t stride,
                                  const Strided<VertexRecord>& records) {
    assert(!records.empty() && records.size() <= vertices_that_fit());
    ByteWriter writer(bytes_);
    write_section_header(writer, SectionKind::vertices, first, stride, records.size(),
                         format_.vertex_bytes(records.size()));
    std::uint8_t* out = writer.grow(records.size() * kVertexBytes);
    for (std::size_t k = 0; k < records.size(); ++k) {
        records.prefetch(k + kAhead);
        out = store_floats(out, records[k].position);
    }
    write_tags(format_, records, writer);
    ++sections_;
}

void DatagramWriter::add_edges(std::span<const EdgeRecord> edges) {
    assert(!edges.empty() && edges.size() <= edges_that_fit());
    ByteWriter writer(bytes_);
    writer.u8(static_cast<std::uint8_t>(SectionKind::edges));
    writer.u16(static_cast<std::uint16_t>(kEdgeSectionBytes - kKindAndLengthBytes +
                                          edges.size() * kEdgeBytes));
    writer.u16(static_cast<std::uint16_t>(edges.size()));
    writer.u32(edges.front().among);
    for (const EdgeRecord& edge : edges) {
        assert(edge.among == edges.front().among);
        writer.u32(edge.a);
        writer.u32(edge.b);
    }
    ++sections_;
}

bool DatagramWriter::add_description(const Description& description) {
    return add_body(SectionKind::description, encode_description(description));
}

bool DatagramWriter::add_page(const PageEntry& entry) {
    return add_body(SectionKind::page, encode_page(entry));
}

bool DatagramWriter::add_body(SectionKind kind, std::span<const std::uint8_t> body) {
    if (sections_ == kMaxSections || free_bytes() < kKindAndLengthBytes + body.size()) return false;
    ByteWriter writer(bytes_);
    writer.u8(static_cast<std::uint8_t>(kind));
    writer.u16(static_cast<std::uint16_t>(body.size()));
    writer.bytes(body);
    ++sections_;
    return true;
}

std::vector<std::uint8_t> DatagramWriter::finish() {
    assert(sections_ > 0);
    ByteWriter(bytes_).u32(crc32c(bytes_));
    return std::move(bytes_);
}

void stamp(std::span<std::uint8_t> datagram, std::uint16_t sequence, std::uint32_t timestamp) {
    assert(datagram.size() >= kHeaderBytes + kTrailerBytes);
    store_u16(datagram.data() + kSequenceOffset, sequence);
    store_u32(datagram.data() + kTimestampOffset, timestamp);
    const auto covered = datagram.first(datagram.size() - kTrailerBytes);
    store_u32(datagram.data() + covered.size(), crc32c(covered));
}

}  // namespace ellicast::protocol
