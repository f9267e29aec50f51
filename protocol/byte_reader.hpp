// protocol/byte_reader.hpp
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ellicast::protocol {

/// Big-endian loads from any address. Each requires as many readable bytes as it returns.
inline std::uint16_t load_u16(const std::uint8_t* p) {
    return static_cast<std::uint16_t>(p[0] << 8 | p[1]);
}
inline std::uint32_t load_u32(const std::uint8_t* p) {
    return static_cast<std::uint32_t>(p[0]) << 24 | static_cast<std::uint32_t>(p[1]) << 16 |
           static_cast<std::uint32_t>(p[2]) << 8 | static_cast<std::uint32_t>(p[3]);
}
inline std::uint64_t load_u64(const std::uint8_t* p) {
    return static_cast<std::uint64_t>(load_u32(p)) << 32 | load_u32(p + 4);
}
inline float load_f32(const std::uint8_t* p) {
    return std::bit_cast<float>(load_u32(p));
}
inline double load_f64(const std::uint8_t* p) {
    return std::bit_cast<double>(load_u64(p));
}

/// Walks over foreign bytes, big-endian, and never past their end: a read that would gives zero (or
/// an empty span) and makes failed() true for good. Check failed() before using what was read.
class ByteReader {
  public:
    explicit ByteReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

    std::uint8_t u8() {
        return number<std::uint8_t>([](const std::uint8_t* p) { return *p; });
    }
    std::uint16_t u16() { return number<std::uint16_t>(load_u16); }
    std::uint32_t u32() { return number<std::uint32_t>(load_u32); }
    std::int32_t i32() { return std::bit_cast<std::int32_t>(u32()); }
    float f32() { return number<float>(load_f32); }
    double f64() { return number<double>(load_f64); }

    std::span<const std::uint8_t> bytes(std::size_t count) {
        if (count > rest_.size()) {
            failed_ = true;
            return {};
        }
        const auto taken = rest_.first(count);
        rest_ = rest_.subspan(count);
        return taken;
    }

    [[nodiscard]] std::size_t left() const { return rest_.size(); }
    [[nodiscard]] bool failed() const { return failed_; }

  private:
    template <class T, class Load>
    T number(Load load) {
        const auto taken = bytes(sizeof(T));
        return taken.empty() ? T{} : load(taken.data());
    }

    std::span<const std::uint8_t> rest_;
    bool failed_ = false;
};

}  // namespace ellicast::protocol
