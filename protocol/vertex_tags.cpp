// protocol/vertex_tags.cpp
#include "protocol/vertex_tags.hpp"

#include <algorithm>
#include <cassert>

namespace ellicast::protocol {
namespace {

constexpr std::uint32_t low_bits(std::size_t bits) {
    return (std::uint32_t{1} << bits) - 1;
}

/// `bits` of a stream from bit `at` on, most significant first. Touches no byte but theirs.
/// Requires bits <= 24.
std::uint32_t load_bits(const std::uint8_t* stream, std::size_t at, std::size_t bits) {
    const std::size_t end = at + bits;
    std::uint32_t value = 0;
    for (std::size_t byte = at / 8; 8 * byte < end; ++byte) value = value << 8 | stream[byte];
    return value >> ((8 - end % 8) % 8) & low_bits(bits);
}

}  // namespace

void load_tags(const RecordFormat& format, std::span<const std::uint8_t> records, std::size_t count,
               std::size_t k, VertexRecord& record) {
    assert(k < count && records.size() == format.vertex_bytes(count));
    const std::size_t bits = format.tag_bits();
    const std::uint8_t* const tags = records.data() + count * kVertexBytes;
    std::uint32_t value = load_bits(tags, k * bits, bits);
    if (format.ring) {
        record.ring = static_cast<std::uint16_t>(value & low_bits(RecordFormat::kRingBits));
        value >>= RecordFormat::kRingBits;
    }
    record.normal = static_cast<std::uint16_t>(value);
    if (format.colour)
        std::copy_n(records.data() + records.size() - 3 * (count - k), 3, record.colour.begin());
}

bool padding_is_zero(const RecordFormat& format, std::span<const std::uint8_t> records,
                     std::size_t count) {
    const std::size_t bits = count * format.tag_bits();
    if (bits % 8 == 0) return true;
    const std::uint8_t last = records[count * kVertexBytes + bits / 8];
    return (last & low_bits(8 - bits % 8)) == 0;
}

void write_tags(const RecordFormat& format, std::span<const VertexRecord> records,
                ByteWriter& writer) {
    const std::size_t bits = format.tag_bits();
    std::uint64_t pending = 0;  // in its lowest `held` bits what makes no whole byte yet
    std::size_t held = 0;
    const auto put = [&](std::uint32_t value, std::size_t size) {
        pending = pending << size | (value & low_bits(size));
        held += size;
        for (; held >= 8; held -= 8) writer.u8(static_cast<std::uint8_t>(pending >> (held - 8)));
    };
    if (bits > 0) {
        for (const VertexRecord& record : records) {
            put(record.normal, format.normal_bits);
            if (format.ring) put(record.ring, RecordFormat::kRingBits);
        }
        if (held > 0) put(0, 8 - held);
    }
    if (!format.colour) return;
    for (const VertexRecord& record : records) writer.bytes(record.colour);
}

}  // namespace ellicast::protocol
