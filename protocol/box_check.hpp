// protocol/box_check.hpp
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace ellicast::protocol {

/// Scalars that are compared side by side: eight points of three.
inline constexpr std::size_t kBoxBlock = 24;
using BoxBlock = std::array<float, kBoxBlock>;

/// Whether each of blocks * kBoxBlock big-endian float32 at `p` lies between `least` and `most`,
/// where scalar k is held against place k % kBoxBlock of both. NaN lies nowhere. Linear; uses wide
/// instructions where the processor has them, with the same answer.
[[nodiscard]] bool all_inside(const std::uint8_t* p, std::size_t blocks, const BoxBlock& least,
                              const BoxBlock& most);

/// The same without wide instructions.
[[nodiscard]] bool all_inside_plain(const std::uint8_t* p, std::size_t blocks,
                                    const BoxBlock& least, const BoxBlock& most);

}  // namespace ellicast::protocol
