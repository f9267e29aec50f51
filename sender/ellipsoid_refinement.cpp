// sender/ellipsoid_refinement.cpp: damped Gauss-Newton steps, all ellipsoids at once.
//
// Everything is in cells of a grid over the solid. With y = L^-1 (x - c), s = |y| and the outward
// normal n = L^-T y / |L^-T y|, a small change of the nine scalars moves the surface at x along n
// by n'(dc + dL y / s). So J = (n, n y'/s), lower triangle, is all that a step needs.
#include "sender/ellipsoid_refinement.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/parallel.hpp"
#include "common/solid_voxels.hpp"
#include "common/triangle_tree.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::GridFrame;
using Eigen::Vector3d;
using Scalars = Eigen::Matrix<float, 9, 1>;  // c, then L row by row
using Curvature = Eigen::Matrix<float, 9, 9>;

constexpr int kMargin = 6;      // cells around the solid: ellipsoids may reach out a little
constexpr int kBand = 3;        // cells; beyond, a distance is just "far"
constexpr float kWidth = 1.0f;  // half of the shell of nodes that tell about a surface, in cells
constexpr float kDeep = -std::numeric_limits<float>::max();  // distance of nodes below the shell
constexpr std::uint32_t kNobody = 0xffffffffu;

// |r| is the cost of a surface that lies r cells off, which is what the volume in between says. As
// a square r^2 / max(|r|, kLeast) it can be solved for; beyond kMost it counts as a true square.
constexpr float kLeast = 0.2f;
constexpr float kMost = 1.0f;
// Pits and bulges deeper than this weigh more. Without it fertility's handles come and go with the
// isolevel.
constexpr float kRough = 0.5f;
constexpr float kRoughWeight = 5.0f;

// Levenberg-Marquardt: a share of the mean curvature, and in absolute terms as much as two nodes
// tell, which holds what nodes say nothing about.
constexpr float kDamping = 0.02f;
constexpr float kHold = 0.5f;
// All move at once, and neighbours make room for each other: whole steps would go too far. They
// shorten towards the end.
constexpr double kFirstStep = 0.7;
constexpr double kLastStep = 0.2;
constexpr double kLongestMove = 1.0;  // cells, of any scalar in one round
constexpr double kThinnest = 0.2;     // cells

struct Row {
    int begin = 0, end = 0;  // half-open
};

// An ellipsoid's distance estimate less the isolevel, row by row; its shell are the nodes where
// that is at most kWidth off zero.
class Shell {
  public:
    Shell(const Ellipsoid& ellipsoid, const GridFrame& frame, double isolevel)
        : isolevel_(static_cast<float>(isolevel)) {
        const Eigen::Matrix3d M =
            ellipsoid.L.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d::Identity().eval());
        M_ = M.cast<float>();
        center_ = ellipsoid.center.cast<float>();
        const Vector3d reach =
            ellipsoid.L.rowwise().norm().array() + isolevel + static_cast<double>(kWidth);
        for (std::size_t a = 0; a < 3; ++a) {
            const auto axis = static_cast<Eigen::Index>(a);
            const double top = frame.dims[a];
            const double from = std::ceil(ellipsoid.center[axis] - reach[axis]);
            const double to = std::floor(ellipsoid.center[axis] + reach[axis]) + 1.0;
            box_[a] = {static_cast<int>(std::clamp(from, 0.0, top)),
                       static_cast<int>(std::clamp(to, 0.0, top))};
        }
        A_ = M.transpose() * M;
        // s (s - 1) / |A d| lies between (s - 1) r and (s - 1) R outside, the reverse inside, r and
        // R the least and largest semi-axis. 1 / |M|_F is at most r.
        const double r = 1.0 / M.norm();
        const double outer = 1.0 + (isolevel + static_cast<double>(kWidth)) / r;
        const double inner = 1.0 - (static_cast<double>(kWidth) - isolevel) / r;
        outer_ = outer * outer;
        inner_ = inner > 0.0 ? inner * inner : -1.0;
    }

    [[nodiscard]] const Row& range(std::size_t axis) const { return box_[axis]; }

    // Nodes of row (j, k) that may belong to the shell or lie below it; `below` surely does.
    struct Rows {
        Row all, below;
    };
    [[nodiscard]] Rows row(int j, int k) const {
        const double dj = j - static_cast<double>(center_[1]);
        const double dk = k - static_cast<double>(center_[2]);
        // d'Ad = a00 (i - mid)^2 + least.
        const double cross = (A_(0, 1) * dj + A_(0, 2) * dk) / A_(0, 0);
        const double least = A_(1, 1) * dj * dj + 2.0 * A_(1, 2) * dj * dk + A_(2, 2) * dk * dk -
                             A_(0, 0) * cross * cross;
        const double mid = static_cast<double>(center_[0]) - cross;
        Rows rows;
        rows.all = within(mid, outer_ - least);
        rows.below = within(mid, inner_ - least);
        if (rows.below.begin >= rows.below.end) rows.below = {rows.all.end, rows.all.end};
        return rows;
    }

    void distances(int j, int k, const Row& row, float* out) const {
        const float dj = static_cast<float>(j) - center_[1];
        const float dk = static_cast<float>(k) - center_[2];
        const float m00 = M_(0, 0), m10 = M_(1, 0), m11 = M_(1, 1);
        const float m20 = M_(2, 0), m21 = M_(2, 1), m22 = M_(2, 2);
        const float rest1 = m11 * dj;
        const float rest2 = m21 * dj + m22 * dk;
        const float first = static_cast<float>(row.begin) - center_[0];
        for (int i = 0; i < row.end - row.begin; ++i) {
            const float di = first + static_cast<float>(i);
            const float y0 = m00 * di, y1 = m10 * di + rest1, y2 = m20 * di + rest2;
            const float a0 = m00 * y0 + m10 * y1 + m20 * y2;
            const float a1 = m11 * y1 + m21 * y2;
            const float a2 = m22 * y2;
            const float s = std::sqrt(y0 * y0 + y1 * y1 + y2 * y2);
            const float a = std::sqrt(a0 * a0 + a1 * a1 + a2 * a2);
            out[i] = (s - 1.0f) * (s + kTiny) / (a + kTiny) - isolevel_;
        }
    }

    // J at node (i, j, k).
    [[nodiscard]] Scalars jacobian(int i, int j, int k) const {
        const float d0 = static_cast<float>(i) - center_[0];
        const float d1 = static_cast<float>(j) - center_[1];
        const float d2 = static_cast<float>(k) - center_[2];
        const float y0 = M_(0, 0) * d0;
        const float y1 = M_(1, 0) * d0 + M_(1, 1) * d1;
        const float y2 = M_(2, 0) * d0 + M_(2, 1) * d1 + M_(2, 2) * d2;
        const float a0 = M_(0, 0) * y0 + M_(1, 0) * y1 + M_(2, 0) * y2;
        const float a1 = M_(1, 1) * y1 + M_(2, 1) * y2;
        const float a2 = M_(2, 2) * y2;
        const float a = 1.0f / (std::sqrt(a0 * a0 + a1 * a1 + a2 * a2) + kTiny);
        const float s = 1.0f / (std::sqrt(y0 * y0 + y1 * y1 + y2 * y2) + kTiny);
        const float n0 = a * a0, n1 = a * a1, n2 = a * a2;
        const float u0 = s * y0, u1 = s * y1, u2 = s * y2;
        Scalars J;
        J << n0, n1, n2, n0 * u0, n1 * u0, n1 * u1, n2 * u0, n2 * u1, n2 * u2;
        return J;
    }

  private:
    static constexpr float kTiny = 1e-6f;

    [[nodiscard]] Row within(double mid, double rest) const {
        if (!(rest > 0.0)) return {};
        const double half = std::sqrt(rest / A_(0, 0));
        const auto from = static_cast<double>(box_[0].begin);
        const auto to = static_cast<double>(box_[0].end);
        return {static_cast<int>(std::clamp(std::ceil(mid - half), from, to)),
                static_cast<int>(std::clamp(std::floor(mid + half) + 1.0, from, to))};
    }

    Eigen::Matrix3f M_;  // L^-1
    Eigen::Vector3f center_;
    float isolevel_;
    Eigen::Matrix3d A_;
    double outer_, inner_;  // of d'Ad
    std::array<Row, 3> box_;
};

// Nodes within kBand cells of some triangle's box; all of them once that is found out faster by
// asking, as with a million needles across the whole model.
std::vector<std::uint8_t> nodes_near(const common::TriangleMesh& solid, const GridFrame& frame) {
    constexpr std::ptrdiff_t kMostRows = 1 << 24;
    std::ptrdiff_t rows = 0;
    std::vector<std::uint8_t> near(frame.size(), 0);
    for (const common::Triangle& triangle : solid.triangles) {
        Eigen::AlignedBox3d box;
        for (const std::uint32_t v : triangle) {
            box.extend(((solid.positions[v] - frame.origin) / frame.spacing).eval());
        }
        const Eigen::Vector3i low = box.min().array().floor().cast<int>().matrix();
        const Eigen::Vector3i high = box.max().array().ceil().cast<int>().matrix();
        const Eigen::Vector3i extent = high - low + Eigen::Vector3i::Constant(2 * kBand - 1);
        rows += std::ptrdiff_t{extent[1]} * extent[2];
        if (rows > kMostRows) return std::vector<std::uint8_t>(frame.size(), 1);
        for (int k = low[2] - kBand + 1; k < high[2] + kBand; ++k) {
            for (int j = low[1] - kBand + 1; j < high[1] + kBand; ++j) {
                std::uint8_t* row = near.data() + frame.index(0, j, k);
                std::fill(row + low[0] - kBand + 1, row + high[0] + kBand, std::uint8_t{1});
            }
        }
    }
    return near;
}

// Signed distance to the solid's surface at the nodes, in cells, cut at kBand.
std::vector<float> distances_to(const common::TriangleMesh& solid, const GridFrame& frame,
                                unsigned threads) {
    static_assert(kMargin > kBand);
    const std::vector<std::uint8_t> inside = common::voxelise_solid(solid, frame, threads);
    const std::vector<std::uint8_t> near = nodes_near(solid, frame);
    const common::TriangleTree tree(solid);
    const double far = kBand * frame.spacing;
    std::vector<float> distances(frame.size());
    const auto layers = static_cast<std::size_t>(frame.dims[2]);
    common::parallel_for(layers, threads, [&](std::size_t first, std::size_t last) {
        for (auto k = static_cast<int>(first); k < static_cast<int>(last); ++k) {
            for (int j = 0; j < frame.dims[1]; ++j) {
                for (int i = 0; i < frame.dims[0]; ++i) {
                    const std::size_t v = frame.index(i, j, k);
                    double d = far;
                    if (near[v] != 0) {
                        const auto hit = tree.closest(frame.position(i, j, k), far * far);
                        d = std::min(far, std::sqrt(hit.squared_distance));
                    }
                    distances[v] = static_cast<float>((inside[v] != 0 ? -d : d) / frame.spacing);
                }
            }
        }
    });
    return distances;
}

class Refinement {
  public:
    Refinement(std::span<const Ellipsoid> chosen, const common::TriangleMesh& solid,
               const RefinementOptions& options)
        : options_(options),
          frame_(common::make_grid_frame(common::bounding_box(solid.positions), options.grid,
                                         kMargin)),
          wanted_(distances_to(solid, frame_, options.threads)) {
        const Eigen::AlignedBox3d box = common::bounding_box(solid.positions);
        low_ = (box.min() - frame_.origin) / frame_.spacing;
        high_ = (box.max() - frame_.origin) / frame_.spacing;
        for (const Ellipsoid& e : chosen) {
            ellipsoids_.push_back(
                {(e.center - frame_.origin) / frame_.spacing, e.L / frame_.spacing});
        }
    }

    void round(double step) {
        shells_.clear();
        for (const Ellipsoid& e : ellipsoids_) shells_.emplace_back(e, frame_, options_.isolevel);
        find_nearest();
        common::parallel_for(ellipsoids_.size(), options_.threads,
                             [&](std::size_t first, std::size_t last) {
                                 for (std::size_t e = first; e < last; ++e) move(e, step);
                             });
    }

    [[nodiscard]] std::vector<Ellipsoid> result() const {
        std::vector<Ellipsoid> result;
        for (const Ellipsoid& e : ellipsoids_) {
            result.push_back({frame_.origin + frame_.spacing * e.center, frame_.spacing * e.L});
        }
        return result;
    }

  private:
    // The least (0) and second least (1) distance at the nodes and whose it is.
    struct Nearest {
        std::vector<float> distance;
        std::vector<std::uint32_t> who;
    };

    void find_nearest() {
        for (Nearest& nearest : nearest_) {
            nearest.distance.assign(frame_.size(), std::numeric_limits<float>::max());
            nearest.who.assign(frame_.size(), kNobody);
        }
        // Whole layers a thread, so no node has two writers; ellipsoids in order, so ties go to the
        // first.
        const auto layers = static_cast<std::size_t>(frame_.dims[2]);
        common::parallel_for(layers, options_.threads, [&](std::size_t first, std::size_t last) {
            std::vector<float> buffer(static_cast<std::size_t>(frame_.dims[0]));
            for (std::uint32_t e = 0; e < shells_.size(); ++e) {
                const Row& ks = shells_[e].range(2);
                const Row& js = shells_[e].range(1);
                const int end = std::min(ks.end, static_cast<int>(last));
                for (int k = std::max(ks.begin, static_cast<int>(first)); k < end; ++k) {
                    for (int j = js.begin; j < js.end; ++j) {
                        const Shell::Rows rows = shells_[e].row(j, k);
                        offer(e, j, k, {rows.all.begin, rows.below.begin}, buffer.data());
                        bury(j, k, rows.below);
                        offer(e, j, k, {rows.below.end, rows.all.end}, buffer.data());
                    }
                }
            }
        });
    }

    // Nodes deep inside an ellipsoid: nobody's, and whoever was nearest is second now.
    void bury(int j, int k, const Row& row) {
        if (row.begin >= row.end) return;
        const std::size_t at = frame_.index(row.begin, j, k);
        for (std::size_t v = at; v < at + static_cast<std::size_t>(row.end - row.begin); ++v) {
            nearest_[1].distance[v] = nearest_[0].distance[v];
            nearest_[1].who[v] = nearest_[0].who[v];
            nearest_[0].distance[v] = kDeep;
            nearest_[0].who[v] = kNobody;
        }
    }

    void offer(std::uint32_t e, int j, int k, const Row& row, float* buffer) {
        if (row.begin >= row.end) return;
        shells_[e].distances(j, k, row, buffer);
        const std::size_t at = frame_.index(row.begin, j, k);
        float* d0 = nearest_[0].distance.data() + at;
        float* d1 = nearest_[1].distance.data() + at;
        std::uint32_t* who0 = nearest_[0].who.data() + at;
        std::uint32_t* who1 = nearest_[1].who.data() + at;
        for (int i = 0; i < row.end - row.begin; ++i) {
            const float d = buffer[i];
            const float a = d0[i], b = d1[i];
            const std::uint32_t x = who0[i], y = who1[i];
            d1[i] = d < a ? a : (d < b ? d : b);
            who1[i] = d < a ? x : (d < b ? e : y);
            d0[i] = d < a ? d : a;
            who0[i] = d < a ? e : x;
        }
    }

    // What node v, which lies `d` off the isosurface of an ellipsoid, says: r, how far that surface
    // lies outside the solid's, and with which weight.
    [[nodiscard]] std::array<float, 2> residual(std::size_t v, float d) const {
        const float r =
            std::clamp(wanted_[v] - d, -static_cast<float>(kBand), static_cast<float>(kBand));
        const float hat = (kWidth - d) * (kWidth + d);
        const float rough = std::abs(r) > kRough ? kRoughWeight : 1.0f;
        return {r, rough * hat / std::clamp(std::abs(r), kLeast, kMost)};
    }

    // Adds node v's share of H = sum w J J' and g = sum w r J.
    void add_node(std::uint32_t e, int i, int j, int k, Curvature& H, Scalars& g) const {
        const std::size_t v = frame_.index(i, j, k);
        const std::size_t rank = nearest_[0].who[v] == e ? 0 : 1;
        if (nearest_[rank].who[v] != e) return;
        const float d = nearest_[rank].distance[v];
        if (!(std::abs(d) < kWidth)) return;
        auto [r, w] = residual(v, d);
        if (rank == 1) w *= static_cast<float>(options_.loss);
        const Scalars J = shells_[e].jacobian(i, j, k);
        H.noalias() += (w * J) * J.transpose();
        g.noalias() += (w * r) * J;
    }

    void move(std::size_t index, double step) {
        const auto e = static_cast<std::uint32_t>(index);
        const Shell& shell = shells_[index];
        Curvature H = Curvature::Zero();
        Scalars g = Scalars::Zero();
        for (int k = shell.range(2).begin; k < shell.range(2).end; ++k) {
            for (int j = shell.range(1).begin; j < shell.range(1).end; ++j) {
                const Shell::Rows rows = shell.row(j, k);
                for (int i = rows.all.begin; i < rows.below.begin; ++i) add_node(e, i, j, k, H, g);
                for (int i = rows.below.end; i < rows.all.end; ++i) add_node(e, i, j, k, H, g);
            }
        }
        H.diagonal().array() += kDamping * H.trace() / 9.0f + kHold;
        // Where the surface lies r outside, it has to move by -r: J dx = -r.
        Eigen::Matrix<double, 9, 1> dx =
            -step * H.cast<double>().ldlt().solve(g.cast<double>()).eval();
        if (!dx.allFinite()) return;
        dx *= std::min(1.0, kLongestMove / std::max(1e-12, dx.cwiseAbs().maxCoeff()));
        apply(dx, ellipsoids_[index]);
    }

    void apply(const Eigen::Matrix<double, 9, 1>& dx, Ellipsoid& ellipsoid) const {
        Ellipsoid moved = ellipsoid;
        moved.center = (moved.center + dx.head<3>()).cwiseMax(low_).cwiseMin(high_);
        Eigen::Index slot = 3;
        for (Eigen::Index row = 0; row < 3; ++row) {
            for (Eigen::Index column = 0; column <= row; ++column) {
                moved.L(row, column) += dx[slot++];
            }
        }
        if (!(moved.L.diagonal().minCoeff() > 0.0)) return;
        const double thin = common::semi_axes(moved)[0];
        if (thin < kThinnest && thin < common::semi_axes(ellipsoid)[0]) return;
        ellipsoid = moved;
    }

    RefinementOptions options_;
    GridFrame frame_;
    std::vector<float> wanted_;  // signed distance to the solid's surface
    Vector3d low_, high_;        // the solid's box
    std::vector<Ellipsoid> ellipsoids_;
    std::vector<Shell> shells_;
    std::array<Nearest, 2> nearest_;
};

}  // namespace

std::vector<Ellipsoid> refine_ellipsoids(std::span<const Ellipsoid> chosen,
                                         const common::TriangleMesh& solid,
                                         const RefinementOptions& options) {
    if (options.rounds <= 0 || chosen.empty()) return {chosen.begin(), chosen.end()};
    Refinement refinement(chosen, solid, options);
    for (int round = 0; round < options.rounds; ++round) {
        const double t = static_cast<double>(round) / options.rounds;
        refinement.round((1.0 - t) * kFirstStep + t * kLastStep);
    }
    return refinement.result();
}

}  // namespace ellicast::sender
