// common/coarse_surface.cpp
#include "common/coarse_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "common/marching_cubes.hpp"
#include "common/mesh_topology.hpp"
#include "common/parallel.hpp"

namespace ellicast::common {
namespace {

// Cells around the box: ellipsoids may reach a little beyond it, the highest isolevel 1.5 cells
// more, and the outermost layer is always outside.
constexpr int kMarginCells = 4;

// In cells, in the order in which they are preferred when no received point can tell (DESIGN
// section 4, which begins with 0.5; the surface of the ellipsoids lies nearer to 0.2).
constexpr std::array<double, 5> kIsolevels = {0.25, 0.5, 0.75, 1.0, 1.5};

// With points, on top of the local isolevel.
constexpr std::array<double, 5> kOffsets = {0.0, 0.25, -0.25, 0.5, 1.0};

// Shares of the binomial filter, in the order in which they are tried at each isolevel: ellipsoids
// that fit snugly leave pits and tunnels of a cell's size between them, which smoothing closes.
// Alone the sharpest field shows the volume best. Under received points a pit is worse than a
// rounded edge, for they restore the edge but not what fell into the pit (fertility at half the
// datagrams lost: rms 5.3e-4 instead of 11e-4).
constexpr std::array<float, 3> kSharpFirst = {0.0F, 0.125F, 0.25F};
constexpr std::array<float, 3> kSmoothFirst = {0.125F, 0.25F, 0.0F};

// A surplus component below this share of the whole volume is debris: a bubble between ellipsoids,
// or one ellipsoid cut off by the loss of its neighbours.
constexpr double kDebrisShare = 0.01;

// Keeps the triangles whose component has keep[c], and renumbers.
TriangleMesh keep_components(const TriangleMesh& mesh, const std::vector<std::uint32_t>& component,
                             const std::vector<bool>& keep) {
    TriangleMesh result;
    constexpr std::uint32_t kUnused = 0xffffffffU;
    std::vector<std::uint32_t> number(mesh.positions.size(), kUnused);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!keep[component[t]]) continue;
        Triangle triangle = mesh.triangles[t];
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
TriangleMesh without_debris(const TriangleMesh& mesh, std::size_t promised) {
    const std::vector<std::uint32_t> component = triangle_components(mesh);
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

Miss miss(const MeshTopology& topology, const PromisedTopology& promise) {
    return {std::abs(static_cast<std::int64_t>(topology.components) -
                     static_cast<std::int64_t>(promise.components)),
            std::abs(topology.euler - promise.euler_all),
            std::abs(topology.euler_largest - promise.euler_largest)};
}

// The field's value at the received points, as a smooth function of space: sums on a coarse
// lattice, one node in kBlockCells cells of the grid.
class LocalIsolevel {
  public:
    LocalIsolevel(const DistanceGrid& grid, std::span<const Eigen::Vector3d> points)
        : h_(grid.frame.spacing) {
        frame_.origin = grid.frame.origin;
        frame_.spacing = kBlockCells * h_;
        for (std::size_t a = 0; a < 3; ++a) {
            frame_.dims[a] = (grid.frame.dims[a] - 1) / kBlockCells + 2;
        }
        sum_.assign(frame_.size(), 0.0);
        weight_.assign(frame_.size(), 0.0);
        for (const Eigen::Vector3d& x : points) {
            const double v = std::clamp(sample(grid, x), kLowest * h_, kHighest * h_);
            add(x, v);
        }
        const double total = std::accumulate(weight_.begin(), weight_.end(), 0.0);
        mean_ = total > 0.0 ? std::accumulate(sum_.begin(), sum_.end(), 0.0) / total : 0.5 * h_;
        for (int axis = 0; axis < 3; ++axis) {
            blur(axis, sum_);
            blur(axis, weight_);
        }
    }

    [[nodiscard]] double operator()(const Eigen::Vector3d& x) const {
        double sum = kPrior * mean_;
        double weight = kPrior;
        for_each_node(x, [&](std::size_t node, double w) {
            sum += w * sum_[node];
            weight += w * weight_[node];
        });
        return sum / weight;
    }

  private:
    static constexpr int kBlockCells = 4;
    static constexpr double kLowest = -0.5;  // in cells
    static constexpr double kHighest = 2.0;
    static constexpr double kPrior = 0.05;  // weight of the mean, in points

    template <class Visit>
    void for_each_node(const Eigen::Vector3d& x, const Visit& visit) const {
        const Eigen::Vector3d g = (x - frame_.origin) / frame_.spacing;
        std::array<int, 3> c{};
        Eigen::Vector3d f;
        for (int axis = 0; axis < 3; ++axis) {
            const int last = frame_.dims[static_cast<std::size_t>(axis)] - 2;
            const double at = std::clamp(g[axis], 0.0, static_cast<double>(last) + 1.0);
            c[static_cast<std::size_t>(axis)] = std::min(static_cast<int>(at), last);
            f[axis] = at - c[static_cast<std::size_t>(axis)];
        }
        for (int corner = 0; corner < 8; ++corner) {
            const int dx = corner & 1;
            const int dy = (corner >> 1) & 1;
            const int dz = corner >> 2;
            visit(frame_.index(c[0] + dx, c[1] + dy, c[2] + dz),
                  (dx ? f[0] : 1 - f[0]) * (dy ? f[1] : 1 - f[1]) * (dz ? f[2] : 1 - f[2]));
        }
    }

    void add(const Eigen::Vector3d& x, double v) {
        for_each_node(x, [&](std::size_t node, double w) {
            sum_[node] += w * v;
            weight_[node] += w;
        });
    }

    // Binomial (1 2 1) / 4 along an axis, zero beyond the ends.
    void blur(int axis, std::vector<double>& field) const {
        const std::vector<double> old = field;
        const auto a = static_cast<std::size_t>(axis);
        std::array<int, 3> n{};
        for (n[2] = 0; n[2] < frame_.dims[2]; ++n[2]) {
            for (n[1] = 0; n[1] < frame_.dims[1]; ++n[1]) {
                for (n[0] = 0; n[0] < frame_.dims[0]; ++n[0]) {
                    const std::size_t here = frame_.index(n[0], n[1], n[2]);
                    std::array<int, 3> m = n;
                    double value = 0.5 * old[here];
                    if (--m[a] >= 0) value += 0.25 * old[frame_.index(m[0], m[1], m[2])];
                    m[a] += 2;
                    if (m[a] < frame_.dims[a]) value += 0.25 * old[frame_.index(m[0], m[1], m[2])];
                    field[here] = value;
                }
            }
        }
    }

    double h_;
    GridFrame frame_;
    std::vector<double> sum_;
    std::vector<double> weight_;
    double mean_ = 0.0;
};

void subtract_local_isolevel(std::span<const Eigen::Vector3d> points, unsigned threads,
                             DistanceGrid& grid) {
    const LocalIsolevel level(grid, points);
    const GridFrame& frame = grid.frame;
    parallel_for(static_cast<std::size_t>(frame.dims[2]), threads,
                 [&](std::size_t begin, std::size_t end) {
                     for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
                         for (int j = 0; j < frame.dims[1]; ++j) {
                             for (int i = 0; i < frame.dims[0]; ++i) {
                                 float& v = grid.values[frame.index(i, j, k)];
                                 if (std::abs(v) > 4.0 * frame.spacing) continue;
                                 v -= static_cast<float>(level(frame.position(i, j, k)));
                             }
                         }
                     }
                 });
}

// The field with every amount of smoothing, each made when it is asked for.
class FieldVariants {
  public:
    FieldVariants(DistanceGrid grid, std::span<const Eigen::Vector3d> points, unsigned threads)
        : grid_(std::move(grid)),
          points_(points),
          shares_(points.empty() ? kSharpFirst : kSmoothFirst),
          threads_(threads) {}

    [[nodiscard]] std::size_t size() const { return made_.size(); }
    const std::vector<float>& values(std::size_t s) {
        if (!made_[s]) {
            made_[s] = smoothed(grid_, shares_[s], threads_);
            if (!points_.empty()) subtract_local_isolevel(points_, threads_, *made_[s]);
        }
        return made_[s]->values;
    }

  private:
    DistanceGrid grid_;
    std::span<const Eigen::Vector3d> points_;
    std::array<float, 3> shares_;
    unsigned threads_;
    std::array<std::optional<DistanceGrid>, 3> made_;
};

}  // namespace

std::optional<CoarseSurface> make_coarse_surface(std::span<const Ellipsoid> ellipsoids,
                                                 std::span<const Eigen::Vector3d> points,
                                                 const Eigen::AlignedBox3d& box,
                                                 const PromisedTopology& promise, int cells,
                                                 unsigned threads) {
    const GridFrame frame = make_grid_frame(box, cells, kMarginCells);
    FieldVariants fields(make_distance_grid(ellipsoids, frame, threads), points, threads);
    std::optional<CoarseSurface> best;
    Miss best_miss{};
    bool best_clean = false;
    for (const double offset : points.empty() ? kIsolevels : kOffsets) {
        const double level = offset * frame.spacing;
        for (std::size_t s = 0; s < fields.size(); ++s) {
            const TriangleMesh whole =
                marching_cubes(frame, fields.values(s), static_cast<float>(level), threads);
            TriangleMesh mesh = without_debris(whole, promise.components);
            if (mesh.triangles.empty()) continue;
            const Miss here = miss(analyse_topology(mesh), promise);
            // Debris tells of pits: the next amount of smoothing may do without.
            const bool clean = mesh.triangles.size() == whole.triangles.size();
            if (!best || std::tuple(here, !clean) < std::tuple(best_miss, !best_clean)) {
                best_miss = here;
                best_clean = clean;
                best = CoarseSurface{std::move(mesh), level, frame.spacing, here == Miss{0, 0, 0}};
            }
            if (best->as_promised && best_clean) return best;
        }
        if (best && best->as_promised) return best;
    }
    return best;
}

}  // namespace ellicast::common
