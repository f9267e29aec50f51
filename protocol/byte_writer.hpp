// protocol/byte_writer.hpp
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ellicast::protocol {

/// Big-endian stores to any address. Each requires as many writable bytes as its value has.
inline void store_u16(std::uint8_t* p, std::uint16_t value) {
    p[0] = static_cast<std::uint8_t>(value >> 8);
    p[1] = static_cast<std::uint8_t>(value);
}
inline void store_u32(std::uint8_t* p, std::uint32_t value) {
    store_u16(p, static_cast<std::uint16_t>(value >> 16));
    store_u16(p + 2, static_cast<std::uint16_t>(value));
}
inline void store_u64(std::uint8_t* p, std::uint64_t value) {
    store_u32(p, static_cast<std::uint32_t>(value >> 32));
    store_u32(p + 4, static_cast<std::uint32_t>(value));
}

/// Appends big-endian fields to a vector that it does not own.
class ByteWriter {
  public:
    explicit ByteWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

    void u8(std::uint8_t value) { bytes_.push_back(value); }
    void u16(std::uint16_t value) { store_u16(grow(2), value); }
    void u32(std::uint32_t value) { store_u32(grow(4), value); }
    void i32(std::int32_t value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void f64(double value) { store_u64(grow(8), std::bit_cast<std::uint64_t>(value)); }
    void bytes(std::span<const std::uint8_t> more) {
        bytes_.insert(bytes_.end(), more.begin(), more.end());
    }

  private:
    std::uint8_t* grow(std::size_t count) {
        bytes_.resize(bytes_.size() + count);
        return bytes_.data() + (bytes_.size() - count);
    }

    std::vector<std::uint8_t>& bytes_;
};

}  // namespace ellicast::protocol
