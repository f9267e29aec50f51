// receiver/coarse_surface.cpp
#include "receiver/coarse_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "common/marching_cubes.hpp"
#include "common/mesh_topology.hpp"

namespace ellicast::receiver {
namespace {

// Cells around the box: ellipsoids may reach a little beyond it, the highest isolevel 1.5 cells
// more, and the outermost layer is always outside.
constexpr int kMarginCells = 4;

// In cells, in the order in which they are preferred when no received point can tell (DESIGN
// section 4).
constexpr std::array<double, 5> kIsolevels = {0.5, 0.25, 0.75, 1.0, 1.5};

// A surplus component below this share of the whole volume is debris: a bubble between ellipsoids,
// or one ellipsoid cut off by the loss of its neighbours.
constexpr double kDebrisShare = 0.01;

// Enough points for a mean that two isolevels 0.25 cells apart cannot tie on.
constexpr std::size_t kMaxFieldSamples = 20'000;

// Keeps the triangles whose component has keep[c], and renumbers.
common::TriangleMesh keep_components(const common::TriangleMesh& mesh,
                                     const std::vector<std::uint32_t>& component,
                                     const std::vector<bool>& keep) {
    common::TriangleMesh result;
    constexpr std::uint32_t kUnused = 0xffffffffU;
    std::vector<std::uint32_t> number(mesh.positions.size(), kUnused);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!keep[component[t]]) continue;
        common::Triangle triangle = mesh.triangles[t];
        for (std::uint32_t& v : triangle) {
            if (number[v] == kUnused) {
                number[v] = static_cast<std::uint32_t>(result.positions.size());
                result.positions.push_back(mesh.positions[v]);
            }
            v = number[v];
        }
        result.triangles.push_back(triangle);
    }
    return result;
}

// Drops the smallest components while there are more than promised and they are debris.
common::TriangleMesh without_debris(const common::TriangleMesh& mesh, std::size_t promised) {
    const std::vector<std::uint32_t> component = common::triangle_components(mesh);
    if (component.empty()) return mesh;
    const std::size_t count =
        *std::max_element(component.begin(), component.end()) + std::size_t{1};
    if (count <= promised) return mesh;
    std::vector<double> volume(count, 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        volume[component[t]] +=
            mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c])) / 6.0;
    }
    double total = 0.0;
    for (const double v : volume) total += std::abs(v);
    std::vector<std::uint32_t> by_size(count);
    std::iota(by_size.begin(), by_size.end(), 0U);
    std::sort(by_size.begin(), by_size.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::tuple(std::abs(volume[a]), a) < std::tuple(std::abs(volume[b]), b);
    });
    std::vector<bool> keep(count, true);
    std::size_t left = count;
    for (const std::uint32_t c : by_size) {
        if (left <= promised || std::abs(volume[c]) >= kDebrisShare * total) break;
        keep[c] = false;
        --left;
    }
    return keep_components(mesh, component, keep);
}

// How far a topology is from the promise: components first, then handles, then which component has
// them.
using Miss = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

Miss miss(const common::MeshTopology& topology, const PromisedTopology& promise) {
    return {std::abs(static_cast<std::int64_t>(topology.components) -
                     static_cast<std::int64_t>(promise.components)),
            std::abs(topology.euler - promise.euler_all),
            std::abs(topology.euler_largest - promise.euler_largest)};
}

// Isolevels in the order in which they are to be tried.
std::array<double, 5> preferred_isolevels(const common::DistanceGrid& grid,
                                          std::span<const Eigen::Vector3d> points) {
    std::array<double, 5> levels = kIsolevels;
    for (double& level : levels) level *= grid.frame.spacing;
    if (points.empty()) return levels;
    const std::size_t stride = std::max<std::size_t>(1, points.size() / kMaxFieldSamples);
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); i += stride) {
        const double v = common::sample(grid, points[i]);
        if (v >= grid.outside) continue;  // far from every ellipsoid that arrived: says nothing
        sum += v;
        ++count;
    }
    if (count == 0) return levels;
    const double mean = sum / static_cast<double>(count);
    std::stable_sort(levels.begin(), levels.end(),
                     [&](double a, double b) { return std::abs(a - mean) < std::abs(b - mean); });
    return levels;
}

}  // namespace

std::optional<CoarseSurface> make_coarse_surface(std::span<const common::Ellipsoid> ellipsoids,
                                                 std::span<const Eigen::Vector3d> points,
                                                 const Eigen::AlignedBox3d& box,
                                                 const PromisedTopology& promise, int cells,
                                                 unsigned threads) {
    const common::GridFrame frame = common::make_grid_frame(box, cells, kMarginCells);
    const common::DistanceGrid grid = common::make_distance_grid(ellipsoids, frame, threads);
    std::optional<CoarseSurface> best;
    Miss best_miss{};
    for (const double level : preferred_isolevels(grid, points)) {
        common::TriangleMesh mesh = without_debris(
            common::marching_cubes(frame, grid.values, static_cast<float>(level), threads),
            promise.components);
        if (mesh.triangles.empty()) continue;
        const Miss here = miss(common::analyse_topology(mesh), promise);
        if (!best || here < best_miss) {
            best_miss = here;
            best = CoarseSurface{std::move(mesh), level, frame.spacing, here == Miss{0, 0, 0}};
        }
        if (best->as_promised) break;
    }
    return best;
}

}  // namespace ellicast::receiver
