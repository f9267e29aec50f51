// protocol/datagram.cpp
#include "protocol/datagram.hpp"

#include <cassert>

#include "protocol/acceptance.hpp"
#include "protocol/description.hpp"
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

EllipsoidRecord SectionView::ellipsoid(std::size_t k) const {
    assert(kind == SectionKind::ellipsoids && k < count);
    return load_ellipsoid(body.data() + k * kEllipsoidBytes);
}

VertexRecord SectionView::vertex(std::size_t k) const {
    assert(kind == SectionKind::vertices && k < count);
    VertexRecord record = load_position(body.data() + k * kVertexBytes);
    if (format != RecordFormat{}) load_tags(format, body, count, k, record);
    return record;
}

Description SectionView::description() const {
    assert(kind == SectionKind::description);
    return decode_description(body);
}

}  // namespace ellicast::protocol
