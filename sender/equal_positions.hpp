// sender/equal_positions.hpp
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/random.hpp"

namespace ellicast::sender {

/// Of each of `count` positions the first that is equal to it: maybe itself. `at(i)` gives the
/// position as three doubles, which are numbers; 0 and -0 are equal. A hash table that is filled in
/// order of index, so that the hash does not show in the result. Linear.
template <class At>
std::vector<std::uint32_t> first_equals(std::size_t count, const At& at) {
    constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> slots(std::bit_ceil(2 * count + 1), kFree);
    std::vector<std::uint32_t> first(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::array<double, 3> position = at(i);
        std::uint64_t hash = 0;
        for (const double x : position) {
            hash = common::Random::finalised(hash + std::bit_cast<std::uint64_t>(x + 0.0));
        }
        std::size_t slot = hash & (slots.size() - 1);
        while (slots[slot] != kFree && at(slots[slot]) != position) {
            slot = (slot + 1) & (slots.size() - 1);
        }
        if (slots[slot] == kFree) slots[slot] = i;
        first[i] = slots[slot];
    }
    return first;
}

}  // namespace ellicast::sender
