// sender/vertex_queue.hpp: private to sender/surface_decimation.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace ellicast::sender {

/// Vertices 0 .. n-1, each at most once, the cheapest first and among equal ones the one with the
/// smallest index: a heap of four children a node that knows where each vertex is, so that a cost
/// can change. Four, because a node's children then share a cache line. Every operation is
/// logarithmic; memory: 20 bytes a vertex.
class VertexQueue {
  public:
    explicit VertexQueue(std::size_t vertices) : place_(vertices, kAbsent) {}

    [[nodiscard]] bool empty() const { return heap_.empty(); }
    [[nodiscard]] std::uint32_t first() const { return heap_.front().vertex; }
    [[nodiscard]] double least() const { return heap_.front().cost; }  // of the first

    /// Puts a vertex in or changes its cost, which is a number (asserted).
    void set(std::uint32_t vertex, double cost) {
        assert(cost == cost);
        const Entry entry{cost, vertex};
        std::size_t at = place_[vertex];
        if (at == kAbsent) {
            at = heap_.size();
            heap_.push_back(entry);
        } else if (heap_[at] < entry) {
            return sink(at, entry);
        }
        rise(at, entry);
    }

    void remove(std::uint32_t vertex) {
        const std::size_t at = place_[vertex];
        if (at == kAbsent) return;
        place_[vertex] = kAbsent;
        const Entry last = heap_.back();
        heap_.pop_back();
        if (last.vertex == vertex) return;
        if (heap_[at] < last) {
            sink(at, last);
        } else {
            rise(at, last);
        }
    }

  private:
    struct Entry {
        double cost;
        std::uint32_t vertex;
        bool operator<(const Entry& other) const {
            return cost != other.cost ? cost < other.cost : vertex < other.vertex;
        }
    };
    static constexpr std::uint32_t kAbsent = std::numeric_limits<std::uint32_t>::max();

    void put(std::size_t at, const Entry& entry) {
        heap_[at] = entry;
        place_[entry.vertex] = static_cast<std::uint32_t>(at);
    }
    void rise(std::size_t at, const Entry& entry) {
        while (at > 0 && entry < heap_[(at - 1) / 4]) {
            put(at, heap_[(at - 1) / 4]);
            at = (at - 1) / 4;
        }
        put(at, entry);
    }
    void sink(std::size_t at, const Entry& entry) {
        for (;;) {
            const std::size_t begin = 4 * at + 1;
            if (begin >= heap_.size()) break;
            const std::size_t end = begin + 4 < heap_.size() ? begin + 4 : heap_.size();
            std::size_t least = begin;
            for (std::size_t child = begin + 1; child < end; ++child) {
                if (heap_[child] < heap_[least]) least = child;
            }
            if (!(heap_[least] < entry)) break;
            put(at, heap_[least]);
            at = least;
        }
        put(at, entry);
    }

    std::vector<Entry> heap_;
    std::vector<std::uint32_t> place_;
};

}  // namespace ellicast::sender
