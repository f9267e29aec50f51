#include "receiver/sketch.hpp"

#include <array>

#include "common/distance_grid.hpp"
#include "common/marching_cubes.hpp"
#include "receiver/object_frame.hpp"

namespace ellicast::receiver {
namespace {

constexpr int kMarginCells = 3;

// In cells. The usual level first; wider ones show what is thinner than a cell.
constexpr std::array<double, 3> kLevels{0.5, 1.0, 1.5};

void fill_in(const ReceivedObject& object, Reconstruction& result) {
    const std::size_t count = result.mesh.positions.size();
    const Eigen::AlignedBox3d box = common::bounding_box(result.mesh.positions);
    result.vertex_index.assign(count, kNotReceived);
    result.provenance.assign(count, Provenance::coarse);
    result.confidence.distance.assign(count, static_cast<float>(box.diagonal().norm()));
    result.confidence.completeness.assign(count, 0.0f);
    result.confidence.expected.assign(count, 0.0f);
    result.summary.missing = object.hint.vertices;
}

}  // namespace

std::optional<Reconstruction> sketch(const ReceivedObject& object, int cells, unsigned threads) {
    const ObjectFrame frame(object.hint);
    const std::vector<common::Ellipsoid> ellipsoids = unit_ellipsoids(object, frame);
    if (ellipsoids.empty()) return std::nullopt;
    const common::DistanceGrid grid = common::make_distance_grid(
        ellipsoids, common::make_grid_frame(frame.unit_box(object.hint), cells, kMarginCells),
        threads);
    Reconstruction result;
    for (const double level : kLevels) {
        result.isolevel = static_cast<float>(level * grid.frame.spacing);
        result.mesh = common::marching_cubes(grid.frame, grid.values, result.isolevel, threads);
        if (!result.mesh.triangles.empty()) break;
    }
    if (result.mesh.triangles.empty()) return std::nullopt;
    const Eigen::Vector3d origin = origin_of(object);
    for (Eigen::Vector3d& p : result.mesh.positions) p = origin + frame.from_unit(p);
    result.isolevel *= static_cast<float>(frame.diagonal);
    fill_in(object, result);
    return result;
}

}  // namespace ellicast::receiver
