// sender/surface_decimation.cpp
#include "sender/surface_decimation.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <utility>

#include "common/parallel.hpp"
#include "sender/decimated_mesh.hpp"
#include "sender/range_decimation.hpp"
#include "sender/spread_order.hpp"

namespace ellicast::sender {
namespace {

// Larger surfaces are decimated in ranges first.
constexpr std::uint32_t kInOneGo = 1u << 17;

// Vertices of the first ranges, a few megabytes in all, so that they stay in a processor's cache;
// and how many are left of them, and of every four taken together.
constexpr std::uint32_t kRange = 1u << 14;
constexpr std::uint32_t kLeftOfRange = kRange / 4;

/// Raises every cost to that of the dearest removal before it: where a cheap removal had to wait
/// for a dear one, both belong to the same scale.
void make_ascending(std::vector<Removal>& removals) {
    float dearest = 0.0f;
    for (Removal& removal : removals) dearest = removal.cost = std::max(dearest, removal.cost);
}

/// By cost, stable: a counting sort of either half of the bits, for floats that are not negative
/// sort as integers do. Linear.
void sort_by_cost(std::vector<Removal>& removals) {
    constexpr std::size_t kDigits = 1u << 16;
    for (const unsigned shift : {0u, 16u}) {
        const Buckets sorted(removals.size(), kDigits, [&](std::size_t k) {
            return std::bit_cast<std::uint32_t>(removals[k].cost) >> shift & (kDigits - 1);
        });
        std::vector<Removal> moved;
        moved.reserve(removals.size());
        for (const std::uint32_t k : sorted.items) moved.push_back(removals[k]);
        removals = std::move(moved);
    }
}

/// Decimates ranges of `size` vertices, each down to kLeftOfRange.
void decimate_ranges(DecimatedMesh& mesh, std::uint32_t size, unsigned threads,
                     std::vector<Removal>& removals) {
    const std::size_t ranges = (mesh.size() + size - 1) / size;
    std::vector<std::vector<Removal>> parts(ranges);
    common::parallel_for(ranges, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k) {
            const auto begin = static_cast<std::uint32_t>(k * size);
            const std::uint32_t end = begin + std::min(size, mesh.size() - begin);
            RangeDecimation(mesh, begin, end).remove(Allowed::good_shape, kLeftOfRange, parts[k]);
            make_ascending(parts[k]);
        }
    });
    for (const std::vector<Removal>& part : parts) {
        removals.insert(removals.end(), part.begin(), part.end());
    }
}

/// Who has no triangle any more, or never had one: who stands for the least area first, and among
/// equals backwards through a spread order.
std::vector<std::uint32_t> isolated(const DecimatedMesh& mesh) {
    std::vector<std::uint32_t> left;
    std::vector<Eigen::Vector3d> places;
    for (std::uint32_t v = 0; v < mesh.size(); ++v) {
        if (mesh.removed[v] != 0) continue;
        left.push_back(v);
        places.push_back(mesh.positions[v]);
    }
    std::vector<std::uint32_t> spread = spread_order(places, 1);
    std::reverse(spread.begin(), spread.end());
    std::stable_sort(spread.begin(), spread.end(), [&](std::uint32_t a, std::uint32_t b) {
        return mesh.quadrics[left[a]].area < mesh.quadrics[left[b]].area;
    });
    for (std::uint32_t& k : spread) k = left[k];
    return spread;
}

}  // namespace

std::vector<std::uint32_t> removal_order(const common::TriangleMesh& surface, unsigned threads) {
    DecimatedMesh mesh(surface);
    std::vector<Removal> removals;
    removals.reserve(mesh.size());
    if (mesh.size() > kInOneGo) {
        for (std::uint64_t size = kRange; size < mesh.size(); size *= 4) {
            decimate_ranges(mesh, static_cast<std::uint32_t>(size), threads, removals);
        }
    }
    std::vector<Removal> last;
    std::vector<Removal> rest;
    {
        RangeDecimation whole(mesh, 0, mesh.size());
        whole.remove(Allowed::good_shape, 0, last);
        whole.remove(Allowed::same_topology, 0, rest);
        whole.remove(Allowed::anything, 0, rest);
    }
    if (!removals.empty()) {
        make_ascending(last);
        removals.insert(removals.end(), last.begin(), last.end());
        sort_by_cost(removals);
        last.clear();
    }
    removals.insert(removals.end(), last.begin(), last.end());
    removals.insert(removals.end(), rest.begin(), rest.end());

    std::vector<std::uint32_t> order;
    order.reserve(mesh.size());
    for (const Removal& removal : removals) order.push_back(mesh.label[removal.vertex]);
    for (const std::uint32_t v : isolated(mesh)) order.push_back(mesh.label[v]);
    return order;
}

common::TriangleMesh collapsed_onto(const common::TriangleMesh& surface,
                                    const std::vector<bool>& keep) {
    assert(keep.size() == surface.positions.size());
    DecimatedMesh mesh(surface);
    std::vector<bool> stays;
    stays.reserve(mesh.size());
    for (const std::uint32_t index : mesh.label) stays.push_back(keep[index]);
    RangeDecimation whole(mesh, 0, mesh.size(), &stays);
    std::vector<Removal> removals;
    whole.remove(Allowed::good_shape, 0, removals);
    whole.remove(Allowed::same_topology, 0, removals);
    common::TriangleMesh result{surface.positions, {}};
    for (const common::Triangle& t : mesh.triangles) {
        if (t[0] == kNone) continue;
        result.triangles.push_back({mesh.label[t[0]], mesh.label[t[1]], mesh.label[t[2]]});
    }
    return result;
}

}  // namespace ellicast::sender
