// protocol/datagram.cpp
#include "protocol/datagram.hpp"

#include <cassert>

#include "protocol/byte_reader.hpp"
#include "protocol/description.hpp"
#include "protocol/page.hpp"
#include "protocol/vertex_tags.hpp"

namespace ellicast::protocol {

std::string_view to_string(WireError error) {
    switch (error) {
        case WireError::too_short:
            return "too_short";
        case WireError::not_rtp:
            return "not_rtp";
        case WireError::unknown_version:
            return "unknown_version";
        case WireError::unsupported_flags:
            return "unsupported_flags";
        case WireError::bad_checksum:
            return "bad_checksum";
        case WireError::bad_hint:
            return "bad_hint";
        case WireError::bad_round:
            return "bad_round";
        case WireError::bad_section:
            return "bad_section";
        case WireError::index_out_of_range:
            return "index_out_of_range";
        case WireError::bad_record:
            return "bad_record";
        case WireError::bad_description:
            return "bad_description";
        case WireError::kCount:
            break;
    }
    assert(false && "not a WireError");
    return "unknown";
}

namespace {
constexpr std::uint8_t kUnknownNormalBits = 0xff;
constexpr std::uint8_t kFormatRing = 4;
constexpr std::uint8_t kFormatColour = 8;
constexpr std::uint8_t kFormatKnown = 15;
}  // namespace

bool RecordFormat::is_known() const {
    return normal_bits == 0 || normal_bits == 8 || normal_bits == 12 || normal_bits == 16;
}

std::uint8_t RecordFormat::code() const {
    assert(is_known());
    const int size = normal_bits == 0 ? 0 : normal_bits / 4 - 1;
    return static_cast<std::uint8_t>(size | (ring ? kFormatRing : 0) |
                                     (colour ? kFormatColour : 0));
}

RecordFormat RecordFormat::of_code(std::uint8_t code) {
    if (code > kFormatKnown) return {.normal_bits = kUnknownNormalBits};
    const int size = code % 4;
    return {.normal_bits = static_cast<std::uint8_t>(size == 0 ? 0 : 4 * (size + 1)),
            .ring = (code & kFormatRing) != 0,
            .colour = (code & kFormatColour) != 0};
}

void SectionView::read(std::size_t k, std::span<EllipsoidRecord> out) const {
    assert(kind == SectionKind::ellipsoids && k + out.size() <= count);
    const std::uint8_t* p = body.data() + k * kEllipsoidBytes;
    for (EllipsoidRecord& record : out) {
        for (float& x : record.scalars) {
            x = load_f32(p);
            p += sizeof(float);
        }
    }
}

void SectionView::read(std::size_t k, std::span<VertexRecord> out) const {
    assert(kind == SectionKind::vertices && k + out.size() <= count);
    const std::uint8_t* p = body.data() + k * kVertexBytes;
    for (VertexRecord& record : out) {
        // Field by field: a whole record built aside and then copied waits for its own stores.
        for (float& x : record.position) {
            x = load_f32(p);
            p += sizeof(float);
        }
        record.normal = record.ring = 0;
        record.colour = {};
        record.unused = 0;
    }
    if (format != RecordFormat{}) load_tags(format, body, count, k, out);
}

EllipsoidRecord SectionView::ellipsoid(std::size_t k) const {
    EllipsoidRecord record;
    read(k, std::span(&record, 1));
    return record;
}

VertexRecord SectionView::vertex(std::size_t k) const {
    VertexRecord record;
    read(k, std::span(&record, 1));
    return record;
}

EdgeRecord SectionView::edge(std::size_t k) const {
    assert(kind == SectionKind::edges && k < count);
    const std::uint8_t* const p = body.data() + k * kEdgeBytes;
    return {among, load_u32(p), load_u32(p + 4)};
}

Description SectionView::description() const {
    assert(kind == SectionKind::description);
    return decode_description(body);
}

PageEntry SectionView::page() const {
    assert(kind == SectionKind::page);
    return decode_page(body);
}

}  // namespace ellicast::protocol
