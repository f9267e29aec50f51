// protocol/byte_writer.hpp
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace ellicast::protocol {

/// Big-endian stores to any address. Each requires as many writable bytes as its value has.
inline void store_u16(std::uint8_t* p, std::uint16_t value) {
    p[0] = static_cast<std::uint8_t>(value >> 8);
    p[1] = static_cast<std::uint8_t>(value);
}
inline void store_u32(std::uint8_t* p, std::uint32_t value) {
    // As a whole, for compilers do not always see that four stores of bytes are one.
    const std::array<std::uint8_t, 4> bytes{
        static_cast<std::uint8_t>(value >> 24), static_cast<std::uint8_t>(value >> 16),
        static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
    const auto whole = std::bit_cast<std::uint32_t>(bytes);
    std::memcpy(p, &whole, sizeof whole);
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
    void u64(std::uint64_t value) { store_u64(grow(8), value); }
    void i32(std::int32_t value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
    void bytes(std::span<const std::uint8_t> more) {
        bytes_.insert(bytes_.end(), more.begin(), more.end());
    }

    /// Appends so many zero bytes, for the caller to overwrite. Valid until the next call.
    std::uint8_t* grow(std::size_t count) {
        bytes_.resize(bytes_.size() + count);
        return bytes_.data() + (bytes_.size() - count);
    }

  private:
    std::vector<std::uint8_t>& bytes_;
};

/// Writes big-endian fields one behind another into bytes that suffice for them (asserted).
class FixedWriter {
  public:
    explicit FixedWriter(std::span<std::uint8_t> bytes) : rest_(bytes) {}

    void u8(std::uint8_t value) { *take(1) = value; }
    void u16(std::uint16_t value) { store_u16(take(2), value); }
    void u32(std::uint32_t value) { store_u32(take(4), value); }
    void u64(std::uint64_t value) { store_u64(take(8), value); }
    void i32(std::int32_t value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
    void bytes(std::span<const std::uint8_t> more) {
        std::copy(more.begin(), more.end(), take(more.size()));
    }

    [[nodiscard]] std::size_t left() const { return rest_.size(); }

  private:
    std::uint8_t* take(std::size_t count) {
        assert(count <= rest_.size());
        std::uint8_t* const p = rest_.data();
        rest_ = rest_.subspan(count);
        return p;
    }

    std::span<std::uint8_t> rest_;
};

}  // namespace ellicast::protocol
