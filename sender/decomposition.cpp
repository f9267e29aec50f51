// sender/decomposition.cpp
#include "sender/decomposition.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/parallel.hpp"
#include "common/random.hpp"
#include "common/solid_voxels.hpp"
#include "sender/constraint_tree.hpp"
#include "sender/ellipsoid_growth.hpp"
#include "sender/ellipsoid_selection.hpp"
#include "sender/surface_facets.hpp"
#include "sender/surface_samples.hpp"
#include "sender/surface_smoothing.hpp"
#include "sender/unit_frame.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::TriangleMesh;
using Eigen::Vector3d;

// What growth needs, in the unit frame.
struct GrowthInput {
    SurfaceSamples seeds;
    ConstraintTree constraints;  // the smoothed surface
    ConstraintTree surface;      // the surface as it is
    GrowthOptions options;
};

// Every vertex, and the triangles that an ellipsoid might slip through between vertices.
Constraints constraints_of(const TriangleMesh& mesh, const std::vector<std::uint32_t>& vertices,
                           const std::vector<std::uint32_t>& large) {
    // More is not the sagitta of a surface that the mesh stands for, it is the mesh.
    constexpr double kLargestOffset = 0.004;
    Constraints constraints;
    constraints.points.reserve(vertices.size());
    for (const std::uint32_t v : vertices) constraints.points.push_back(mesh.positions[v]);
    constraints.triangles = offset_triangles(mesh, large, kLargestOffset);
    return constraints;
}

GrowthInput prepare_growth(const TriangleMesh& unit, const DecompositionOptions& options) {
    const int steps = options.presmooth < 0 ? default_smoothing_steps(unit) : options.presmooth;
    const TriangleMesh smoothed{smoothed_positions(unit, steps), unit.triangles};
    const std::vector<std::uint32_t> vertices = used_vertices(unit);
    const std::vector<std::uint32_t> large = large_triangles(unit, options.facet_edge);
    ConstraintTree constraints(constraints_of(smoothed, vertices, large));
    ConstraintTree surface(constraints_of(unit, vertices, large), constraints);
    GrowthOptions growth;
    growth.epsilon = options.epsilon;
    growth.max_aspect = options.max_aspect;
    return {place_seeds(smoothed, options.candidates, options.seed), std::move(constraints),
            std::move(surface), growth};
}

// Order of the seeds along a Morton curve, so that a growth's contacts are good guesses for the
// next.
std::vector<std::uint32_t> spatial_order(const std::vector<Vector3d>& points) {
    const auto spread = [](std::uint64_t v) {  // two zero bits behind each of 10 bits
        v = (v | (v << 16)) & 0x030000ffu;
        v = (v | (v << 8)) & 0x0300f00fu;
        v = (v | (v << 4)) & 0x030c30c3u;
        return (v | (v << 2)) & 0x09249249u;
    };
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
    keys.reserve(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        std::uint64_t key = 0;
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
            const double cell = std::clamp((points[i][axis] + 0.5) * 1024.0, 0.0, 1023.0);
            key |= spread(static_cast<std::uint64_t>(cell)) << axis;
        }
        keys.emplace_back(key, i);
    }
    std::sort(keys.begin(), keys.end());
    std::vector<std::uint32_t> order;
    order.reserve(keys.size());
    for (const auto& [key, index] : keys) order.push_back(index);
    return order;
}

// One result a seed, in seed order.
std::vector<std::optional<Ellipsoid>> grow_all(const GrowthInput& input, unsigned threads) {
    // Guesses pass from seed to seed inside a block, never across, so that what a seed sees does
    // not depend on the number of threads.
    constexpr std::size_t kBlock = 64;
    const std::vector<std::uint32_t> order = spatial_order(input.seeds.points);
    const std::size_t blocks = (order.size() + kBlock - 1) / kBlock;
    std::vector<std::optional<Ellipsoid>> grown(order.size());
    common::parallel_for(blocks, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t block = first; block < last; ++block) {
            GrowthContacts contacts;
            const std::size_t end = std::min(order.size(), (block + 1) * kBlock);
            for (std::size_t i = block * kBlock; i < end; ++i) {
                const std::uint32_t s = order[i];
                grown[s] =
                    grow_ellipsoid({input.seeds.points[s], input.seeds.inward[s]},
                                   input.constraints, input.surface, input.options, contacts);
            }
        }
    });
    return grown;
}

// Nodes at the centres of the voxels that fill the box: nodes on its faces would lie on the faces
// of an axis-aligned model, where no ellipsoid can cover them.
common::GridFrame voxel_centers(const Eigen::AlignedBox3d& box, int cells) {
    common::GridFrame frame = common::make_grid_frame(box, std::max(1, cells), 1);
    frame.origin += Eigen::Vector3d::Constant(0.5 * frame.spacing);
    return frame;
}

SelectionOptions selection_options(const DecompositionOptions& options, double diagonal) {
    SelectionOptions selection;
    selection.count = options.ellipsoids;
    selection.diagonal = diagonal;
    selection.threads = options.threads;
    if (options.criterion == Criterion::robust) {
        selection.loss = std::clamp(options.expected_loss, 0.0, 0.99);
        selection.thinness = true;
        selection.outside = 0.5;
    }
    return selection;
}

}  // namespace

std::vector<Ellipsoid> grow_candidates(const TriangleMesh& solid,
                                       const DecompositionOptions& options) {
    const UnitFrame frame(solid.positions);
    const GrowthInput input = prepare_growth(frame.to_unit(solid), options);
    std::vector<Ellipsoid> candidates;
    for (const std::optional<Ellipsoid>& grown : grow_all(input, options.threads)) {
        if (grown) candidates.push_back(frame.to_model(*grown));
    }
    return candidates;
}

Decomposition select_ellipsoids(const std::vector<Ellipsoid>& candidates, const TriangleMesh& solid,
                                const DecompositionOptions& options) {
    const Eigen::AlignedBox3d box = common::bounding_box(solid.positions);
    const common::GridFrame grid = voxel_centers(box, options.grid);
    const std::vector<std::uint8_t> voxels = common::voxelise_solid(solid, grid, options.threads);
    const Selection selection = select_greedily(
        candidates, grid, voxels, selection_options(options, box.diagonal().stableNorm()));
    Decomposition decomposition;
    decomposition.seeds = options.candidates;
    decomposition.candidates = candidates.size();
    for (const std::uint32_t chosen : selection.order) {
        decomposition.ellipsoids.push_back(candidates[chosen]);
    }
    const double all = std::max(1.0, static_cast<double>(selection.solid));
    decomposition.covered = static_cast<double>(selection.covered) / all;
    decomposition.outside = static_cast<double>(selection.outside) / all;
    return decomposition;
}

Decomposition decompose(const TriangleMesh& solid, const DecompositionOptions& options) {
    const std::vector<Ellipsoid> candidates = grow_candidates(solid, options);
    if (candidates.empty()) {
        throw std::invalid_argument("no ellipsoid fits into the model");
    }
    Decomposition decomposition = select_ellipsoids(candidates, solid, options);
    if (decomposition.ellipsoids.empty()) {
        throw std::invalid_argument("no ellipsoid covers a voxel of the model");
    }
    return decomposition;
}

}  // namespace ellicast::sender
