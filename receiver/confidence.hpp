// receiver/confidence.hpp: where a result can be trusted, and where vertices are missing.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::receiver {

/// How near each vertex of a mesh is to what was measured, and how much of its surroundings was.
///
/// `distance`: length of the shortest path of edges to a received vertex; 0 at received ones, at
/// most the diagonal of the mesh's box (also where no path leads to one). Unit: the mesh's.
///
/// `expected`: how many vertices of the original the place of each vertex probably had. Nobody
/// tells where the missing ones were, only how many; so cells of the surface that are larger than
/// those around them are taken for cells where some are missing:
///     a_i  area of the surface nearer (along edges) to received vertex i than to any other
///     q_i  lower quartile of a over the cells within two steps of cell i: what is usual there
///     m_i = max(0, a_i / (c q_i) - 1), with the one c for which the m_i add up to `missing`
/// The 1 + m_i vertices of a cell are spread over its area. Parts of the surface that no received
/// vertex reaches get area / (c q) with the lower quartile q of all. The sum is received + missing.
///
/// `completeness`: received over expected vertices nearby, 0 to 1: both counts are spread over the
/// neighbours of each vertex kSpreadingSteps times (each gives equal shares to its neighbours and
/// to itself), then divided. 1 everywhere when nothing is missing.
///
/// An estimate: where the original itself changes from dense to sparse within a few vertices, the
/// sparse side looks as if some were missing; and a loss that changes only over many vertices looks
/// like a sparser original, and counts as even. (Losses of datagrams are even: their records lie
/// far apart.)
struct Confidence {
    std::vector<float> distance;  // each with one value per vertex
    std::vector<float> completeness;
    std::vector<float> expected;
};
inline constexpr int kSpreadingSteps = 3;

/// Requires a closed manifold and `received` ascending (asserted). Same input, same bits, on any
/// number of threads. Cost: n log n.
Confidence measure_confidence(const common::TriangleMesh& mesh,
                              const std::vector<std::uint32_t>& received, std::uint64_t missing,
                              unsigned threads);

/// A share of the surface that lies farther than this from every received vertex.
struct FartherShare {
    double distance = 0;
    double share = 0;
};

struct Gap {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double radius = 0;
};

struct OctantCount {
    std::uint64_t received = 0;
    double expected = 0;
};

/// What is missing, and where. Distances are in the mesh's unit; on a triangle, that of its centre
/// through the nearest corner counts for all of it.
struct ConfidenceSummary {
    std::uint64_t missing = 0;              // vertices that did not arrive
    std::optional<Gap> largest_gap{};       // the triangle farthest from any received vertex
    std::array<FartherShare, 4> farther{};  // at kFartherThan times the diagonal of the box
    /// Of the box: octant k has the larger x, y, z where its bit 0, 1, 2 is set. Sums to what was
    /// received and expected, up to received vertices that are no vertex of the mesh.
    std::array<OctantCount, 8> octants{};
};
inline constexpr std::array<double, 4> kFartherThan{0.005, 0.01, 0.02, 0.05};

/// Of what measure_confidence() said of the same mesh, vertices and number. No gap when nothing is
/// missing. Linear.
ConfidenceSummary summarise(const Confidence& confidence, const common::TriangleMesh& mesh,
                            const std::vector<std::uint32_t>& received, std::uint64_t missing,
                            const Eigen::AlignedBox3d& box);

}  // namespace ellicast::receiver
