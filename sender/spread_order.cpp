// sender/spread_order.cpp
#include "sender/spread_order.hpp"

#include <algorithm>
#include <bit>

#include "common/random.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {
namespace {

/// Spreads the lower 21 bits of x to every third bit.
std::uint64_t every_third_bit(std::uint64_t x) {
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    x = (x | x << 2) & 0x1249249249249249u;
    return x;
}

}  // namespace

std::vector<std::uint32_t> morton_order(const std::vector<Eigen::Vector3d>& positions) {
    const Eigen::AlignedBox3d box = common::bounding_box(positions);
    const double longest = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
    const double scale = longest > 0.0 ? ((1 << 21) - 1) / longest : 0.0;
    struct Key {
        std::uint64_t code;
        std::uint32_t index;
    };
    std::vector<Key> keys;
    keys.reserve(positions.size());
    for (const Eigen::Vector3d& p : positions) {
        std::uint64_t code = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const auto cell = static_cast<std::uint64_t>((p[axis] - box.min()[axis]) * scale);
            code |= every_third_bit(cell) << axis;
        }
        keys.push_back({code, static_cast<std::uint32_t>(keys.size())});
    }
    std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        return a.code != b.code ? a.code < b.code : a.index < b.index;
    });
    std::vector<std::uint32_t> order;
    order.reserve(keys.size());
    for (const Key& key : keys) order.push_back(key.index);
    return order;
}

std::vector<std::uint32_t> spread_order(const std::vector<Eigen::Vector3d>& positions,
                                        std::uint64_t seed) {
    const std::vector<std::uint32_t> along_curve = morton_order(positions);
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
