// sender/edge_table.hpp: private to sender/model_preparation.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/parallel.hpp"
#include "common/triangle_mesh.hpp"

namespace ellicast::sender {

/// Half-edge 3 t + c runs from corner c of triangle t to the next one.
using HalfEdge = std::uint32_t;
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

inline std::uint32_t triangle_of(HalfEdge h) {
    return h / 3;
}
inline HalfEdge next_in_triangle(HalfEdge h) {
    return h % 3 == 2 ? h - 2 : h + 1;
}
inline std::uint32_t origin(const std::vector<common::Triangle>& triangles, HalfEdge h) {
    return triangles[h / 3][h % 3];
}
inline std::uint32_t target(const std::vector<common::Triangle>& triangles, HalfEdge h) {
    return origin(triangles, next_in_triangle(h));
}

/// Items put into buckets by a key in [0, keys): a counting sort, linear and stable.
struct Buckets {
    std::vector<std::uint32_t> items;
    std::vector<std::uint32_t> first;  // keys + 1 offsets into items

    template <class Key>
    Buckets(std::size_t count, std::size_t keys, const Key& key) : items(count), first(keys + 2) {
        // Two places ahead: then filling the buckets leaves the offsets where they belong.
        for (std::size_t i = 0; i < count; ++i) ++first[key(i) + 2];
        for (std::size_t k = 2; k < first.size(); ++k) first[k] += first[k - 1];
        for (std::size_t i = 0; i < count; ++i) {
            items[first[key(i) + 1]++] = static_cast<std::uint32_t>(i);
        }
        first.pop_back();
    }
    std::span<std::uint32_t> bucket(std::size_t key) {
        return std::span(items).subspan(first[key], first[key + 1] - first[key]);
    }
};

/// Calls visit(span of half-edges) once for every undirected edge; the half-edges come in ascending
/// order. On one thread edges come in ascending order of their two ends, on several (0: one per
/// core) many at one time. Triangles must have three different corners. About linear.
template <class Visit>
void for_each_edge(const std::vector<common::Triangle>& triangles, std::size_t vertices,
                   const Visit& visit, unsigned threads = 1) {
    const auto lower = [&](std::size_t h) {
        const auto half = static_cast<HalfEdge>(h);
        return std::min(origin(triangles, half), target(triangles, half));
    };
    Buckets by_lower(3 * triangles.size(), vertices, lower);
    common::parallel_for(vertices, threads, [&](std::size_t first, std::size_t last) {
        std::vector<std::uint64_t> keys;  // upper end << 32 | half-edge
        for (std::size_t v = first; v < last; ++v) {
            const std::span<HalfEdge> edges = by_lower.bucket(v);
            keys.clear();
            for (const HalfEdge h : edges) {
                const std::uint32_t upper = std::max(origin(triangles, h), target(triangles, h));
                keys.push_back(std::uint64_t{upper} << 32 | h);
            }
            std::sort(keys.begin(), keys.end());
            for (std::size_t k = 0; k < keys.size(); ++k) edges[k] = static_cast<HalfEdge>(keys[k]);
            for (std::size_t begin = 0, end = 0; begin < keys.size(); begin = end) {
                while (end < keys.size() && keys[end] >> 32 == keys[begin] >> 32) ++end;
                visit(std::span<const HalfEdge>(edges.subspan(begin, end - begin)));
            }
        }
    });
}

/// Disjoint sets whose representative is the smallest member.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t size) : parent_(size) {
        for (std::size_t i = 0; i < size; ++i) parent_[i] = static_cast<std::uint32_t>(i);
    }
    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace ellicast::sender
