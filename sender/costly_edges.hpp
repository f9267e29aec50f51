// sender/costly_edges.hpp
#pragma once

#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"
#include "protocol/datagram.hpp"

namespace ellicast::sender {

/// Edges worth telling by name: those that a receiver who goes by the diagonal rule would get wrong
/// or nearly so, and whose loss would cost most (area of the two triangles x squared distance of
/// the two diagonals). Few edges hold most of the error: of horse's 145 449, the first 121 hold
/// nine tenths.
struct CostlyEdgeOptions {
    int normal_bits = 0;  // of the tags that the receiver has
    std::uint8_t diagonal_rule = 0;
    unsigned threads = 0;  // 0: one per core; does not change the result
    /// One list for each of these numbers of vertices, ascending: of the surface collapsed onto the
    /// first so many. The last may be all.
    std::vector<std::uint32_t> levels;
};

/// `surface`: its first `vertices` positions are the object's records in index order; positions
/// behind them are nobody's and are collapsed first. A two-hundredth as many edges as vertices on
/// each level (a fiftieth up to 64), by ascending level and descending cost. Deterministic. Cost: a
/// heap of the edges of each level, and as much of a decimation as the levels ask for
/// (removal_order()).
std::vector<protocol::EdgeRecord> costly_edges(common::TriangleMesh surface, std::uint32_t vertices,
                                               const CostlyEdgeOptions& options);

}  // namespace ellicast::sender
