// sender/decomposition.cpp
#include "sender/decomposition.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "common/morton_order.hpp"
#include "common/parallel.hpp"
#include "common/random.hpp"
#include "common/solid_voxels.hpp"
#include "sender/clustered_surface.hpp"
#include "sender/constraint_tree.hpp"
#include "sender/ellipsoid_growth.hpp"
#include "sender/ellipsoid_refinement.hpp"
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

// One result a seed, in seed order.
std::vector<std::optional<Ellipsoid>> grow_all(const GrowthInput& input, unsigned threads) {
    // Guesses pass from seed to seed inside a block, never across, so that what a seed sees does
    // not depend on the number of threads.
    constexpr std::size_t kBlock = 64;
    // Neighbours follow each other, so that a growth's contacts are good guesses for the next.
    const std::vector<std::uint32_t> order = common::morton_order(input.seeds.points);
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

struct Voxels {
    common::GridFrame frame;
    std::vector<std::uint8_t> solid;
};

// The solid's voxels; finer than asked for while it is so thin that hardly a voxel's centre meets
// it.
Voxels voxels_of(const TriangleMesh& solid, const Eigen::AlignedBox3d& box, int cells,
                 unsigned threads) {
    constexpr std::ptrdiff_t kFewVoxels = 1000;
    constexpr std::size_t kMostNodes = 1u << 25;  // 128 MB of gains
    Voxels voxels{voxel_centers(box, cells), {}};
    for (;;) {
        voxels.solid = common::voxelise_solid(solid, voxels.frame, threads);
        const std::ptrdiff_t inside =
            std::count_if(voxels.solid.begin(), voxels.solid.end(), [](auto v) { return v != 0; });
        cells *= 2;
        const common::GridFrame finer = voxel_centers(box, cells);
        if (inside >= kFewVoxels || finer.size() > kMostNodes) return voxels;
        voxels.frame = finer;
    }
}

// Largest first: what is left to go by where no voxel can tell what an ellipsoid adds.
std::vector<std::uint32_t> by_volume(const std::vector<Ellipsoid>& candidates, std::size_t count) {
    std::vector<std::uint32_t> order(candidates.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return common::volume(candidates[a]) > common::volume(candidates[b]);
    });
    order.resize(std::min(order.size(), count));
    return order;
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

std::vector<Ellipsoid> taken(const std::vector<Ellipsoid>& from,
                             const std::vector<std::uint32_t>& order) {
    std::vector<Ellipsoid> result;
    result.reserve(order.size());
    for (const std::uint32_t index : order) result.push_back(from[index]);
    return result;
}

// The order made one of all `count`: those left out come last, by index.
std::vector<std::uint32_t> with_the_rest(std::vector<std::uint32_t> order, std::size_t count) {
    std::vector<bool> there(count, false);
    for (const std::uint32_t index : order) there[index] = true;
    for (std::uint32_t index = 0; index < count; ++index) {
        if (!there[index]) order.push_back(index);
    }
    return order;
}

// The surface that ellipsoids grow inside and are refined to: the solid's own, or of a huge one no
// more than shows at their scale. A cluster is a quarter of a receiver's cell.
TriangleMesh fitted_surface(const TriangleMesh& solid) {
    constexpr std::size_t kMostTriangles = 1u << 20;
    constexpr double kCluster = 1.0 / 512;  // of the diagonal
    if (solid.triangles.size() <= kMostTriangles) return solid;
    const double diagonal = common::bounding_box(solid.positions).diagonal().stableNorm();
    return clustered_surface(solid, kCluster * diagonal);
}

// Whether there is a frame to compute in: not for the empty mesh, nor for one single point.
bool has_extent(const TriangleMesh& mesh) {
    const Eigen::AlignedBox3d box = common::bounding_box(mesh.positions);
    return !box.isEmpty() && box.diagonal().stableNorm() > 0.0;
}

}  // namespace

std::vector<Ellipsoid> grow_candidates(const TriangleMesh& solid,
                                       const DecompositionOptions& options) {
    if (!has_extent(solid)) return {};
    const UnitFrame frame(solid.positions);
    const TriangleMesh unit = frame.to_unit(fitted_surface(solid));
    const Eigen::AlignedBox3d box = common::bounding_box(unit.positions);
    std::vector<Ellipsoid> candidates;
    for (const std::optional<Ellipsoid>& grown :
         grow_all(prepare_growth(unit, options), options.threads)) {
        // A centre outside the box comes from a patch that is not oriented outwards.
        if (grown && box.contains(grown->center)) candidates.push_back(frame.to_model(*grown));
    }
    return candidates;
}

Decomposition select_ellipsoids(const std::vector<Ellipsoid>& candidates, const TriangleMesh& solid,
                                const DecompositionOptions& options) {
    Decomposition decomposition;
    decomposition.seeds = options.candidates;
    decomposition.candidates = candidates.size();
    if (candidates.empty() || !has_extent(solid)) return decomposition;
    const Eigen::AlignedBox3d box = common::bounding_box(solid.positions);
    const Voxels voxels = voxels_of(solid, box, options.grid, options.threads);
    const SelectionOptions rule = selection_options(options, box.diagonal().stableNorm());
    Selection selection = select_greedily(candidates, voxels.frame, voxels.solid, rule);
    decomposition.ellipsoids =
        taken(candidates, selection.order.empty() ? by_volume(candidates, options.ellipsoids)
                                                  : selection.order);
    if (options.refine > 0 && !selection.order.empty()) {
        RefinementOptions refinement;
        refinement.rounds = options.refine;
        // Copies save most ellipsoids from the loss that the selection reckons with.
        refinement.loss = rule.loss / 3.0;
        refinement.threads = options.threads;
        const std::vector<Ellipsoid> refined =
            refine_ellipsoids(decomposition.ellipsoids, fitted_surface(solid), refinement);
        selection = select_greedily(refined, voxels.frame, voxels.solid, rule);
        decomposition.ellipsoids = taken(refined, with_the_rest(selection.order, refined.size()));
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
    return select_ellipsoids(candidates, solid, options);
}

}  // namespace ellicast::sender
