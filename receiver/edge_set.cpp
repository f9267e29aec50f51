// receiver/edge_set.cpp
#include "receiver/edge_set.hpp"

#include <algorithm>
#include <iterator>

namespace ellicast::receiver {
namespace {

constexpr std::uint32_t kVerticesPerEdge = 16;
constexpr std::size_t kAlwaysKept = 64;
// A red-black node (three pointers and a colour), the edge, and the allocator's own 16 bytes.
constexpr std::size_t kNodeBytes = 48 + sizeof(protocol::EdgeRecord);

}  // namespace

EdgeSet::EdgeSet(std::uint32_t vertices)
    : most_(std::max<std::size_t>(kAlwaysKept, vertices / kVerticesPerEdge)) {}

bool EdgeSet::insert(const protocol::EdgeRecord& edge, MemoryBudget& budget) {
    if (edges_.size() == most_ && *edges_.rbegin() < edge) return true;
    if (edges_.contains(edge)) return true;
    if (edges_.size() == most_) erase_last(budget);
    if (!budget.take(kNodeBytes, edges_.size() * kNodeBytes)) return false;
    edges_.insert(edge);
    return true;
}

bool EdgeSet::merge(const EdgeSet& other, MemoryBudget& budget) {
    return std::all_of(other.edges_.begin(), other.edges_.end(),
                       [&](const protocol::EdgeRecord& edge) { return insert(edge, budget); });
}

void EdgeSet::release(MemoryBudget& budget) {
    budget.give_back(edges_.size() * kNodeBytes);
    edges_.clear();
}

void EdgeSet::erase_last(MemoryBudget& budget) {
    edges_.erase(std::prev(edges_.end()));
    budget.give_back(kNodeBytes);
}

}  // namespace ellicast::receiver
