// receiver/edge_set.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>

#include "protocol/datagram.hpp"
#include "receiver/record_table.hpp"

namespace ellicast::receiver {

/// The edges that a sender named. What is kept is a function of the set of those inserted: all of
/// them, or the smallest in order where they are more than an honest sender names (one for each 16
/// vertices, 64 at least). Memory is taken from the budget edge by edge.
class EdgeSet {
  public:
    /// Of an object of that many vertices.
    explicit EdgeSet(std::uint32_t vertices);

    /// False when there is no memory left for it. Logarithmic.
    bool insert(const protocol::EdgeRecord& edge, MemoryBudget& budget);
    /// Inserts all of `other`. False when memory ran out on the way.
    bool merge(const EdgeSet& other, MemoryBudget& budget);
    /// Gives everything back; the set is empty then.
    void release(MemoryBudget& budget);

    [[nodiscard]] std::size_t size() const { return edges_.size(); }
    [[nodiscard]] const std::set<protocol::EdgeRecord>& edges() const { return edges_; }

  private:
    void erase_last(MemoryBudget& budget);

    std::size_t most_;
    std::set<protocol::EdgeRecord> edges_;
};

}  // namespace ellicast::receiver
