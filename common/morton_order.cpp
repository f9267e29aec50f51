// common/morton_order.cpp
#include "common/morton_order.hpp"

#include <array>
#include <cstddef>
#include <utility>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {
namespace {

constexpr int kCodeBits = 63;
constexpr int kDigitBits = 11;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;

struct Key {
    std::uint64_t code;
    std::uint32_t index;
};

/// Spreads the lower 21 bits of x to every third bit.
std::uint64_t every_third_bit(std::uint64_t x) {
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    x = (x | x << 2) & 0x1249249249249249u;
    return x;
}

std::vector<Key> keys_of(const std::vector<Eigen::Vector3d>& positions) {
    const Eigen::AlignedBox3d box = bounding_box(positions);
    const double longest = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
    const double scale = longest > 0.0 ? ((1 << 21) - 1) / longest : 0.0;
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
    return keys;
}

// Least digit first; each pass keeps the order of equal digits, so that ties stay by index.
void sort_by_code(std::vector<Key>& keys) {
    std::vector<Key> sorted(keys.size());
    for (int shift = 0; shift < kCodeBits; shift += kDigitBits) {
        const auto digit = [shift](const Key& key) { return key.code >> shift & (kDigits - 1); };
        std::array<std::size_t, kDigits + 1> first{};
        for (const Key& key : keys) ++first[digit(key) + 1];
        for (std::size_t d = 0; d < kDigits; ++d) first[d + 1] += first[d];
        for (const Key& key : keys) sorted[first[digit(key)]++] = key;
        std::swap(keys, sorted);
    }
}

}  // namespace

std::vector<std::uint32_t> morton_order(const std::vector<Eigen::Vector3d>& positions) {
    std::vector<Key> keys = keys_of(positions);
    sort_by_code(keys);
    std::vector<std::uint32_t> order;
    order.reserve(keys.size());
    for (const Key& key : keys) order.push_back(key.index);
    return order;
}

}  // namespace ellicast::common
