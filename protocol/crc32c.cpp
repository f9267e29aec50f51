// protocol/crc32c.cpp
#include "protocol/crc32c.hpp"

#include <array>
#include <cstddef>
#include <cstring>

#if defined(__x86_64__) && defined(__GNUC__)
#define ELLICAST_CRC_INSTRUCTION 1
#endif

namespace ellicast::protocol {
namespace {

constexpr std::uint32_t kPolynomial = 0x82f63b78u;  // x^32 + x^28 + ... + 1, bits reflected

using Table = std::array<std::uint32_t, 256>;

/// tables[k][b]: what byte b adds to the remainder when k further zero bytes follow it.
constexpr std::array<Table, 8> make_tables() {
    std::array<Table, 8> tables{};
    for (std::uint32_t b = 0; b < 256; ++b) {
        std::uint32_t remainder = b;
        for (int bit = 0; bit < 8; ++bit) {
            remainder = (remainder >> 1) ^ ((remainder & 1u) != 0 ? kPolynomial : 0u);
        }
        tables[0][b] = remainder;
    }
    for (std::size_t k = 1; k < 8; ++k) {
        for (std::size_t b = 0; b < 256; ++b) {
            const std::uint32_t before = tables[k - 1][b];
            tables[k][b] = (before >> 8) ^ tables[0][before & 0xffu];
        }
    }
    return tables;
}

constexpr std::array<Table, 8> kTables = make_tables();

std::uint32_t load_le32(const std::uint8_t* p) {
    return static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8 |
           static_cast<std::uint32_t>(p[2]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
}

#ifdef ELLICAST_CRC_INSTRUCTION

/// The instruction gives its result after three cycles but can begin every cycle: so three
/// stretches of this many bytes run side by side. Two rounds of them cover nearly all of a default
/// datagram.
constexpr std::size_t kStretch = 192;

/// A remainder's own four bytes looked up: what it becomes when `zeros` zero bytes follow.
using Advance = std::array<Table, 4>;

constexpr Advance make_advance(std::size_t zeros) {
    std::array<std::uint32_t, 32>
        of_bit{};  // the map is linear: enough to know where each bit goes
    for (std::size_t bit = 0; bit < 32; ++bit) {
        std::uint32_t remainder = 1u << bit;
        for (std::size_t k = 0; k < zeros; ++k) {
            remainder = (remainder >> 8) ^ kTables[0][remainder & 0xffu];
        }
        of_bit[bit] = remainder;
    }
    Advance advance{};
    for (std::size_t byte = 0; byte < 4; ++byte) {
        for (std::size_t value = 0; value < 256; ++value) {
            for (std::size_t bit = 0; bit < 8; ++bit) {
                if ((value >> bit & 1u) != 0) advance[byte][value] ^= of_bit[8 * byte + bit];
            }
        }
    }
    return advance;
}

constexpr Advance kAdvanceOne = make_advance(kStretch);
constexpr Advance kAdvanceTwo = make_advance(2 * kStretch);

std::uint32_t advanced(const Advance& advance, std::uint64_t crc) {
    return advance[0][crc & 0xffu] ^ advance[1][(crc >> 8) & 0xffu] ^
           advance[2][(crc >> 16) & 0xffu] ^ advance[3][(crc >> 24) & 0xffu];
}

std::uint64_t load_native64(const std::uint8_t* p) {
    std::uint64_t value = 0;
    std::memcpy(&value, p, sizeof(value));
    return value;
}

__attribute__((target("sse4.2"))) std::uint32_t crc32c_by_instruction(
    std::span<const std::uint8_t> bytes) {
    std::uint64_t crc = 0xffffffffu;
    const std::uint8_t* p = bytes.data();
    std::size_t left = bytes.size();
    for (; left >= 3 * kStretch; left -= 3 * kStretch, p += 3 * kStretch) {
        std::uint64_t second = 0;
        std::uint64_t third = 0;
        for (std::size_t k = 0; k < kStretch; k += 8) {
            crc = __builtin_ia32_crc32di(crc, load_native64(p + k));
            second = __builtin_ia32_crc32di(second, load_native64(p + kStretch + k));
            third = __builtin_ia32_crc32di(third, load_native64(p + 2 * kStretch + k));
        }
        crc = advanced(kAdvanceTwo, crc) ^ advanced(kAdvanceOne, second) ^ third;
    }
    for (; left >= 8; left -= 8, p += 8) crc = __builtin_ia32_crc32di(crc, load_native64(p));
    auto rest = static_cast<std::uint32_t>(crc);
    for (; left > 0; --left, ++p) rest = __builtin_ia32_crc32qi(rest, *p);
    return ~rest;
}

/// Before this is set, during the start of the program, the tables do the work.
const bool kHasInstruction = [] {
    __builtin_cpu_init();
    return __builtin_cpu_supports("sse4.2") != 0;
}();

#endif

}  // namespace

std::uint32_t crc32c_by_table(std::span<const std::uint8_t> bytes) {
    std::uint32_t crc = ~0u;
    const std::uint8_t* p = bytes.data();
    std::size_t left = bytes.size();
    for (; left >= 8; left -= 8, p += 8) {  // eight bytes a step, each with its own table
        const std::uint32_t low = load_le32(p) ^ crc;
        const std::uint32_t high = load_le32(p + 4);
        crc = kTables[7][low & 0xffu] ^ kTables[6][(low >> 8) & 0xffu] ^
              kTables[5][(low >> 16) & 0xffu] ^ kTables[4][low >> 24] ^ kTables[3][high & 0xffu] ^
              kTables[2][(high >> 8) & 0xffu] ^ kTables[1][(high >> 16) & 0xffu] ^
              kTables[0][high >> 24];
    }
    for (; left > 0; --left, ++p) crc = (crc >> 8) ^ kTables[0][(crc ^ *p) & 0xffu];
    return ~crc;
}

std::uint32_t crc32c(std::span<const std::uint8_t> bytes) {
#ifdef ELLICAST_CRC_INSTRUCTION
    if (kHasInstruction) return crc32c_by_instruction(bytes);
#endif
    return crc32c_by_table(bytes);
}

}  // namespace ellicast::protocol
