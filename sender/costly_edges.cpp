// sender/costly_edges.cpp
#include "sender/costly_edges.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "common/diagonal_choice.hpp"
#include "common/parallel.hpp"
#include "sender/diagonal_quads.hpp"
#include "sender/surface_decimation.hpp"

namespace ellicast::sender {
namespace {

using common::TriangleMesh;
using Eigen::Vector3d;
using protocol::EdgeRecord;

// Edges told of a level with so many vertices: a two-hundredth, 0.04 bytes a vertex. A hundredth
// instead brings horse from 0.255 to 0.24e-4, bunny from 0.42 to 0.38e-4. On small levels up to 64,
// where they gain more: spot 0.61 to 0.43e-4.
constexpr std::size_t count_for(std::uint32_t vertices) {
    return std::max<std::size_t>((vertices + 199) / 200, std::min(64u, vertices / 50));
}

// The other diagonal may be worse by so many mean edge lengths and still be taken, once flips
// around it have changed what it is judged by.
constexpr double kDoubt = 0.5;

struct Candidate {
    double cost;
    HalfEdge half_edge;
};

std::vector<Vector3d> known_to_receiver(const TriangleMesh& mesh, int bits, unsigned threads) {
    if (bits > 0) return decoded_normals(mesh, bits, threads);
    std::vector<Vector3d> normals = area_normals(mesh);
    for (Vector3d& n : normals) n.normalize();
    return normals;
}

// Half-edges that are looked at together, whoever does it.
constexpr std::size_t kPart = 1u << 15;

// Between vertices below `among`, with their costs; those that cost nothing apart.
std::vector<Candidate> candidates_of(const Quads& quads, std::uint32_t among, unsigned threads) {
    const auto look = [&](std::size_t begin, std::size_t end) {
        std::vector<Candidate> found;
        for (auto h = static_cast<HalfEdge>(begin); h < end; ++h) {
            if (!quads.has_quad(h)) continue;
            const std::array<std::uint32_t, 4> id = quads.ids(h);
            if (std::max(id[0], id[1]) >= among) continue;
            const double cost = quads.wrong_diagonal(h);
            if (cost > 0.0) found.push_back({cost, h});
        }
        return found;
    };
    return common::joined(common::in_parts(quads.half_edges(), kPart, threads, look));
}

// Costs are cheap to tell; whether the receiver would get an edge wrong is asked of the costliest
// only, until there are enough.
std::vector<EdgeRecord> costliest(const TriangleMesh& mesh, std::uint32_t among, double loss,
                                  const CostlyEdgeOptions& options) {
    const std::vector<Vector3d> normals =
        known_to_receiver(mesh, options.normal_bits, options.threads);
    const Quads quads(mesh, normals, options.threads);
    const common::DiagonalWeights weights =
        common::diagonal_weights(options.diagonal_rule, options.normal_bits > 0, loss);
    const double unit = common::mean_edge_length(mesh);
    const auto record = [&](HalfEdge h) {
        const std::array<std::uint32_t, 4> id = quads.ids(h);
        return EdgeRecord{among, std::min(id[0], id[1]), std::max(id[0], id[1])};
    };
    std::vector<Candidate> heap = candidates_of(quads, among, options.threads);
    const auto later = [&](const Candidate& x, const Candidate& y) {
        return x.cost != y.cost ? x.cost < y.cost : record(y.half_edge) < record(x.half_edge);
    };
    std::make_heap(heap.begin(), heap.end(), later);
    std::vector<EdgeRecord> edges;
    const std::size_t count = count_for(among);
    while (edges.size() < count && !heap.empty()) {
        const HalfEdge h = heap.front().half_edge;
        std::pop_heap(heap.begin(), heap.end(), later);
        heap.pop_back();
        const double gain = common::weighed_diagonal_gain(quads.quad(h), weights, unit);
        if (gain > -kDoubt * unit) edges.push_back(record(h));
    }
    return edges;
}

}  // namespace

std::vector<EdgeRecord> costly_edges(TriangleMesh surface, std::uint32_t vertices,
                                     const CostlyEdgeOptions& options) {
    assert(surface.positions.size() >= vertices);
    assert(std::is_sorted(options.levels.begin(), options.levels.end()));
    std::vector<std::vector<EdgeRecord>> levels;
    for (std::size_t k = options.levels.size(); k-- > 0;) {  // each from the one above
        const std::uint32_t among = options.levels[k];
        assert(among <= vertices);
        if (among < vertices) {
            std::vector<bool> keep(surface.positions.size(), false);
            std::fill_n(keep.begin(), among, true);
            surface = collapsed_onto(surface, keep);
        }
        const double loss = 1.0 - static_cast<double>(among) / static_cast<double>(vertices);
        levels.push_back(costliest(surface, among, loss, options));
    }
    std::vector<EdgeRecord> edges;
    for (std::size_t k = levels.size(); k-- > 0;) {
        edges.insert(edges.end(), levels[k].begin(), levels[k].end());
    }
    return edges;
}

}  // namespace ellicast::sender
