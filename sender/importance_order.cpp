// sender/importance_order.cpp
#include "sender/importance_order.hpp"

#include <algorithm>

#include "common/random.hpp"
#include "sender/spread_order.hpp"

namespace ellicast::sender {
namespace {

// A few datagrams: below that, which of them comes first makes no difference to anyone.
constexpr std::uint32_t kFirstStratum = 512;

}  // namespace

std::vector<std::uint32_t> importance_strata(std::uint32_t vertices) {
    std::vector<std::uint32_t> bounds;
    std::uint32_t bound = vertices;
    for (; bound >= kFirstStratum; bound -= bound / 2) bounds.push_back(bound);
    if (bound > 0) bounds.push_back(bound);
    bounds.push_back(0);
    std::reverse(bounds.begin(), bounds.end());
    return bounds;
}

std::vector<std::uint32_t> spread_within_strata(const std::vector<Eigen::Vector3d>& positions,
                                                std::uint64_t seed) {
    const std::vector<std::uint32_t> bounds =
        importance_strata(static_cast<std::uint32_t>(positions.size()));
    common::Random random(seed);
    std::vector<std::uint32_t> order;
    order.reserve(positions.size());
    for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
        const std::vector<Eigen::Vector3d> stratum(positions.begin() + bounds[k],
                                                   positions.begin() + bounds[k + 1]);
        for (const std::uint32_t index : spread_order(stratum, random.next())) {
            order.push_back(bounds[k] + index);
        }
    }
    return order;
}

}  // namespace ellicast::sender
