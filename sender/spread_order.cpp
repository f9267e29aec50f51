// sender/spread_order.cpp
#include "sender/spread_order.hpp"

#include <bit>
#include <cstddef>

#include "common/morton_order.hpp"
#include "common/random.hpp"

namespace ellicast::sender {
std::vector<std::uint32_t> spread_order(const std::vector<Eigen::Vector3d>& positions,
                                        std::uint64_t seed) {
    const std::vector<std::uint32_t> along_curve = common::morton_order(positions);
    const std::size_t count = along_curve.size();

    // A binary tree over the ranks: every node halves its range. Which half is visited first is a
    // coin tossed once per node; that one is the larger of an odd range. The root is node 1, the
    // half of node n that is visited first (second) is node 2n (2n + 1).
    common::Random random(seed);
    std::vector<bool> right_first(std::bit_ceil(count + 1), false);
    for (std::size_t node = 0; node < right_first.size(); ++node) {
        right_first[node] = (random.next() >> 63) != 0;
    }

    // Bit j of the visit's number chooses the half at depth j. So the visits 0..2^d-1, and every
    // later aligned run of 2^d, enter each of the 2^d ranges of depth d once; and a stride that is
    // odd keeps that, since it runs through all residues of 2^d.
    std::vector<std::uint32_t> order(count);
    for (std::size_t visit = 0; visit < count; ++visit) {
        std::size_t begin = 0;
        std::size_t size = count;
        std::size_t node = 1;
        for (std::size_t bits = visit; size > 1; bits >>= 1) {
            const bool second = (bits & 1) != 0;
            const bool right = second != right_first[node];
            const std::size_t part = second ? size / 2 : size - size / 2;
            if (right) begin += size - part;
            size = part;
            node = 2 * node + (second ? 1 : 0);
        }
        order[visit] = along_curve[begin];
    }
    return order;
}

}  // namespace ellicast::sender
