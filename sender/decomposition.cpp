// sender/decomposition.cpp
#include "sender/decomposition.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "common/parallel.hpp"
#include "common/random.hpp"
#include "common/solid_voxels.hpp"
#include "sender/constraint_tree.hpp"
#include "sender/ellipsoid_growth.hpp"
#include "sender/ellipsoid_selection.hpp"
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
    std::vector<Seed> seeds;
    ConstraintTree constraints;  // samples of the smoothed surface
    ConstraintTree surface;      // the same samples on the surface as it is
    GrowthOptions options;
};

std::vector<Vector3d> sample_positions(const SurfaceSamples& samples,
                                       const std::vector<Vector3d>& positions) {
    std::vector<Vector3d> out;
    out.reserve(samples.points.size());
    for (const SurfacePoint& point : samples.points) out.push_back(point.position(positions));
    return out;
}

void append_seeds(const SurfaceSamples& samples, std::span<const std::uint32_t> which,
                  const std::vector<Vector3d>& positions, std::vector<Seed>& seeds) {
    for (const std::uint32_t i : which) {
        seeds.push_back({samples.points[i].position(positions), samples.inward[i]});
    }
}

// One half of the seeds are samples, which stand where the mesh is fine, the other half stratified
// by area, which stand wherever there is surface.
std::vector<Seed> place_seeds(const TriangleMesh& smoothed, const SurfaceSamples& samples,
                              std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<std::uint32_t> order(samples.points.size());
    std::iota(order.begin(), order.end(), 0u);
    common::shuffle(order, random);
    order.resize(std::min(order.size(), count / 2));
    std::vector<Seed> seeds;
    append_seeds(samples, order, smoothed.positions, seeds);

    const SurfaceSamples by_area = random_surface_points(smoothed, count - seeds.size(), random);
    order.resize(by_area.points.size());
    std::iota(order.begin(), order.end(), 0u);
    append_seeds(by_area, order, smoothed.positions, seeds);
    std::erase_if(seeds, [](const Seed& s) { return s.inward.isZero(); });
    return seeds;
}

GrowthInput prepare_growth(const TriangleMesh& unit, const DecompositionOptions& options) {
    const int steps = options.presmooth < 0 ? default_smoothing_steps(unit) : options.presmooth;
    constexpr double kLeastSpacing = 0.001;  // bounds the samples to some million per unit area
    const double spacing = options.sample_spacing > 0
                               ? std::max(kLeastSpacing, options.sample_spacing)
                               : default_sample_spacing(unit);
    const TriangleMesh smoothed{smoothed_positions(unit, steps), unit.triangles};
    const SurfaceSamples samples = sample_surface(smoothed, spacing);
    GrowthOptions growth;
    growth.epsilon = options.epsilon;
    growth.max_aspect = options.max_aspect;
    ConstraintTree constraints(sample_positions(samples, smoothed.positions));
    ConstraintTree surface(sample_positions(samples, unit.positions), constraints);
    return {place_seeds(smoothed, samples, options.candidates, options.seed),
            std::move(constraints), std::move(surface), growth};
}

// Order of the seeds along a Morton curve, so that a growth's contacts are good guesses for the
// next.
std::vector<std::uint32_t> spatial_order(const std::vector<Seed>& seeds) {
    const auto spread = [](std::uint64_t v) {  // two zero bits behind each of 10 bits
        v = (v | (v << 16)) & 0x030000ffu;
        v = (v | (v << 8)) & 0x0300f00fu;
        v = (v | (v << 4)) & 0x030c30c3u;
        return (v | (v << 2)) & 0x09249249u;
    };
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
    keys.reserve(seeds.size());
    for (std::uint32_t i = 0; i < seeds.size(); ++i) {
        std::uint64_t key = 0;
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
            const double cell = std::clamp((seeds[i].point[axis] + 0.5) * 1024.0, 0.0, 1023.0);
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
    const std::vector<std::uint32_t> order = spatial_order(input.seeds);
    const std::size_t blocks = (order.size() + kBlock - 1) / kBlock;
    std::vector<std::optional<Ellipsoid>> grown(order.size());
    common::parallel_for(blocks, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t block = first; block < last; ++block) {
            GrowthContacts contacts;
            const std::size_t end = std::min(order.size(), (block + 1) * kBlock);
            for (std::size_t i = block * kBlock; i < end; ++i) {
                grown[order[i]] = grow_ellipsoid(input.seeds[order[i]], input.constraints,
                                                 input.surface, input.options, contacts);
            }
        }
    });
    return grown;
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
    const common::GridFrame grid = common::make_grid_frame(box, std::max(1, options.grid), 1);
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
