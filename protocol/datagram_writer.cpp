// protocol/datagram_writer.cpp
#include <algorithm>
#include <cassert>
#include <utility>

#include "protocol/byte_writer.hpp"
#include "protocol/crc32c.hpp"
#include "protocol/datagram.hpp"
#include "protocol/description.hpp"
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

void write_hint(ByteWriter& writer, const Hint& hint) {
    for (const float x : hint.box_min) writer.f32(x);
    for (const float x : hint.box_max) writer.f32(x);
    writer.u32(hint.components);
    writer.i32(hint.euler_all);
    writer.i32(hint.euler_largest);
    writer.u16(hint.ellipsoids);
    writer.u32(hint.vertices);
    writer.u8(hint.format.code());
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

std::span<const float> scalars(const EllipsoidRecord& record) {
    return record.scalars;
}
std::span<const float> scalars(const VertexRecord& record) {
    return record.position;
}

template <class Record>
void write_records(std::vector<std::uint8_t>& bytes, SectionKind kind, std::uint32_t first,
                   std::uint32_t stride, std::span<const Record> records) {
    const std::size_t length = kIndexBytes + records.size() * record_bytes(kind);
    ByteWriter writer(bytes);
    writer.u8(static_cast<std::uint8_t>(kind));
    writer.u16(static_cast<std::uint16_t>(length));
    writer.u16(static_cast<std::uint16_t>(records.size()));
    writer.u32(first);
    writer.u32(stride);
    for (const Record& record : records) {
        for (const float x : scalars(record)) writer.f32(x);
    }
}

/// Records of this many bytes that fit into a new section.
std::size_t records_that_fit(std::size_t free_bytes, std::size_t sections, std::size_t each) {
    if (sections == kMaxSections || free_bytes < kSectionHeaderBytes) return 0;
    const std::size_t body = std::min<std::size_t>(free_bytes - kKindAndLengthBytes, 0xffff);
    return (body - kIndexBytes) / each;
}

}  // namespace

std::array<std::uint8_t, kCanonicalHintBytes> canonical_bytes(const Hint& hint) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(kCanonicalHintBytes);
    ByteWriter writer(bytes);
    write_hint(writer, hint);
    writer.u8(hint.approximate ? 1 : 0);
    std::array<std::uint8_t, kCanonicalHintBytes> out{};
    assert(bytes.size() == out.size());
    std::ranges::copy(bytes, out.begin());
    return out;
}

DatagramWriter::DatagramWriter(const DatagramHeader& header, std::size_t capacity)
    : capacity_(capacity) {
    assert(capacity >= kMinDatagramBytes && capacity <= kMaxDatagramBytes);
    bytes_.reserve(capacity);
    ByteWriter writer(bytes_);
    write_header(writer, header);
    assert(bytes_.size() == kHeaderBytes);
}

std::size_t DatagramWriter::free_bytes() const {
    return capacity_ - kTrailerBytes - bytes_.size();
}

std::size_t DatagramWriter::ellipsoids_that_fit() const {
    return records_that_fit(free_bytes(), sections_, kEllipsoidBytes);
}

std::size_t DatagramWriter::vertices_that_fit() const {
    return records_that_fit(free_bytes(), sections_, kVertexBytes);
}

void DatagramWriter::add_ellipsoids(std::uint32_t first, std::uint32_t stride,
                                    std::span<const EllipsoidRecord> records) {
    assert(!records.empty() && records.size() <= ellipsoids_that_fit());
    write_records(bytes_, SectionKind::ellipsoids, first, stride, records);
    ++sections_;
}

void DatagramWriter::add_vertices(std::uint32_t first, std::uint32_t stride,
                                  std::span<const VertexRecord> records) {
    assert(!records.empty() && records.size() <= vertices_that_fit());
    write_records(bytes_, SectionKind::vertices, first, stride, records);
    ++sections_;
}

bool DatagramWriter::add_description(const Description& description) {
    const std::vector<std::uint8_t> body = encode_description(description);
    if (sections_ == kMaxSections || free_bytes() < kKindAndLengthBytes + body.size()) return false;
    ByteWriter writer(bytes_);
    writer.u8(static_cast<std::uint8_t>(SectionKind::description));
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
