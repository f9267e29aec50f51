// receiver/eviction.hpp
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <numeric>
#include <vector>

namespace ellicast::receiver {

/// Which of many competing entries to give up for a new one. The half with the greatest weight is
/// safe; among the others the one that was silent longest goes, ties by the greater index. So a
/// flood of strangers that come once pushes out itself, and a newcomer still gets a place, and time
/// to grow. Requires at least one entry (asserted). Deterministic.
template <class Entries, class Weight, class LastSeen>
std::size_t entry_to_evict(const Entries& entries, const Weight& weight,
                           const LastSeen& last_seen) {
    assert(!entries.empty());
    std::vector<std::size_t> order(entries.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return weight(entries[a]) > weight(entries[b]);
    });
    std::size_t victim = order.back();
    for (std::size_t k = entries.size() / 2; k < order.size(); ++k) {
        const auto seen = last_seen(entries[order[k]]);
        const auto oldest = last_seen(entries[victim]);
        if (seen < oldest || (seen == oldest && order[k] > victim)) victim = order[k];
    }
    return victim;
}

}  // namespace ellicast::receiver
