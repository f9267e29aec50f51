// protocol/vertex_tags.cpp
#include "protocol/vertex_tags.hpp"

#include <algorithm>
#include <cassert>

namespace ellicast::protocol {
namespace {

constexpr std::uint32_t low_bits(std::size_t bits) {
    return (std::uint32_t{1} << bits) - 1;
}

/// Reads a stream of bits from bit `at` on, most significant first. Touches no byte but those of
/// the bits asked for.
class BitReader {
  public:
    BitReader(const std::uint8_t* stream, std::size_t at) : next_(stream + at / 8) {
        if (at % 8 != 0) take(at % 8);
    }
    /// Requires bits <= 24.
    std::uint32_t take(std::size_t bits) {
        for (; held_ < bits; held_ += 8) pending_ = pending_ << 8 | *next_++;
        held_ -= bits;
        return static_cast<std::uint32_t>(pending_ >> held_) & low_bits(bits);
    }

  private:
    const std::uint8_t* next_;
    std::uint64_t pending_ = 0;  // in its lowest `held_` bits what was not taken yet
    std::size_t held_ = 0;
};

void write_colours(const RecordFormat& format, const Strided<VertexRecord>& records,
                   std::uint8_t* out) {
    if (!format.colour) return;
    for (std::size_t k = 0; k < records.size(); ++k) {
        out = std::copy(records[k].colour.begin(), records[k].colour.end(), out);
    }
}

}  // namespace

void load_tags(const RecordFormat& format, std::span<const std::uint8_t> records, std::size_t count,
               std::size_t k, std::span<VertexRecord> out) {
    assert(k + out.size() <= count && records.size() == format.vertex_bytes(count));
    const std::size_t normal_bits = format.normal_bits;
    const std::size_t ring_bits = format.ring ? RecordFormat::kRingBits : 0;
    if (normal_bits == 8 && !format.ring) {  // what senders do unless told otherwise
        const std::uint8_t* tag = records.data() + count * kVertexBytes + k;
        for (VertexRecord& record : out) record.normal = *tag++;
    } else {
        BitReader tags(records.data() + count * kVertexBytes, k * format.tag_bits());
        for (VertexRecord& record : out) {
            record.normal = static_cast<std::uint16_t>(tags.take(normal_bits));
            record.ring = static_cast<std::uint16_t>(tags.take(ring_bits));
        }
    }
    if (!format.colour) return;
    const std::uint8_t* colour = records.data() + records.size() - 3 * (count - k);
    for (VertexRecord& record : out) {
        std::copy_n(colour, 3, record.colour.begin());
        colour += 3;
    }
}

bool padding_is_zero(const RecordFormat& format, std::span<const std::uint8_t> records,
                     std::size_t count) {
    const std::size_t bits = count * format.tag_bits();
    if (bits % 8 == 0) return true;
    const std::uint8_t last = records[count * kVertexBytes + bits / 8];
    return (last & low_bits(8 - bits % 8)) == 0;
}

void write_tags(const RecordFormat& format, const Strided<VertexRecord>& records,
                ByteWriter& writer) {
    const std::size_t bits = format.tag_bits();
    std::uint8_t* out =
        writer.grow(format.vertex_bytes(records.size()) - records.size() * kVertexBytes);
    if (bits == 8 && !format.ring) {  // what senders do unless told otherwise
        for (std::size_t k = 0; k < records.size(); ++k) {
            *out++ = static_cast<std::uint8_t>(records[k].normal);
        }
        return write_colours(format, records, out);
    }
    std::uint64_t pending = 0;  // in its lowest `held` bits what makes no whole byte yet
    std::size_t held = 0;
    const auto put = [&](std::uint32_t value, std::size_t size) {
        pending = pending << size | (value & low_bits(size));
        held += size;
        for (; held >= 8; held -= 8) *out++ = static_cast<std::uint8_t>(pending >> (held - 8));
    };
    if (bits > 0) {
        for (std::size_t k = 0; k < records.size(); ++k) {
            put(records[k].normal, format.normal_bits);
            if (format.ring) put(records[k].ring, RecordFormat::kRingBits);
        }
        if (held > 0) put(0, 8 - held);
    }
    write_colours(format, records, out);
}

}  // namespace ellicast::protocol
