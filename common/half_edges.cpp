// common/half_edges.cpp
#include "common/half_edges.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace ellicast::common {
namespace {

// Calls visit(half-edge) by face, then corner.
template <class Visit>
void for_each_half_edge(const TriangleMesh& mesh, const Visit& visit) {
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
        const Triangle& t = mesh.triangles[f];
        for (std::uint32_t c = 0; c < 3; ++c) {
            assert(t[c] < mesh.positions.size());
            const auto [low, high] = std::minmax(t[c], t[c == 2 ? 0 : c + 1]);
            visit(HalfEdge{std::uint64_t{low} << 32 | high, static_cast<std::uint32_t>(f), c});
        }
    }
}

// Few and almost in order: by insertion, unless someone made a fan of thousands.
void sort_stably_by_key(HalfEdge* first, HalfEdge* last) {
    constexpr std::ptrdiff_t kFew = 32;
    const auto less = [](const HalfEdge& a, const HalfEdge& b) { return a.key < b.key; };
    if (last - first > kFew) return std::stable_sort(first, last, less);
    for (HalfEdge* next = first; next != last; ++next) {
        const HalfEdge moving = *next;
        HalfEdge* place = next;
        for (; place != first && less(moving, place[-1]); --place) *place = place[-1];
        *place = moving;
    }
}

}  // namespace

// Those of each smaller vertex are put together by counting, in the order of faces and corners,
// which the sort by larger vertices keeps.
std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
    std::vector<std::size_t> end(mesh.positions.size() + 1, 0);
    for_each_half_edge(mesh, [&](const HalfEdge& h) { ++end[(h.key >> 32) + 1]; });
    for (std::size_t v = 0; v + 1 < end.size(); ++v) end[v + 1] += end[v];
    std::vector<HalfEdge> half_edges(3 * mesh.triangles.size());
    // From the first to the last of each vertex: end[v] moves on to where its name says it is.
    for_each_half_edge(mesh, [&](const HalfEdge& h) { half_edges[end[h.key >> 32]++] = h; });
    std::size_t first = 0;
    for (const std::size_t last : end) {
        sort_stably_by_key(half_edges.data() + first, half_edges.data() + last);
        first = last;
    }
    return half_edges;
}

}  // namespace ellicast::common
