// common/ring_tag.hpp
#pragma once

#include <cstddef>
#include <cstdint>

namespace ellicast::common {

/// What 8 bits tell of a vertex's ring, its distinct neighbours along the edges of the original
/// mesh: bits 0-2 their number modulo 8, bits 3-7 the sum of their hashes modulo 32. A receiver
/// that has all neighbours can see whether it joined the right ones: a wrong ring of the right size
/// passes once in 32.

/// The top 5 bits of what the SplitMix64 finaliser ([SLF14]) makes of a vertex record's index.
std::uint8_t ring_hash(std::uint32_t index);

/// `hash_sum` is that of the neighbours' ring_hash, not yet reduced.
std::uint16_t ring_tag(std::size_t valence, unsigned hash_sum);

/// The parts of a tag: valence modulo 8, sum modulo 32. Bits above the eighth are ignored.
unsigned ring_valence(std::uint16_t tag);
unsigned ring_sum(std::uint16_t tag);

}  // namespace ellicast::common
