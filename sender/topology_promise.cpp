// sender/topology_promise.cpp: promise_topology of sender/model_preparation.hpp.
#include <cstdint>
#include <future>
#include <string>
#include <vector>

#include "common/marching_cubes.hpp"
#include "common/mesh_topology.hpp"
#include "common/parallel.hpp"
#include "common/solid_voxels.hpp"
#include "sender/model_preparation.hpp"

namespace ellicast::sender {
namespace {

using common::MeshTopology;

// Receivers work at about the first; the others are for parts too thin for it.
constexpr int kGrids[] = {96, 128, 192, 256};

struct Shape {
    MeshTopology topology;
    double volume = 0;
};

Shape shape_of(const common::TriangleMesh& mesh) {
    return {common::analyse_topology(mesh), common::signed_volume(mesh)};
}

// The boundary of the voxels inside the solid.
Shape shape_of_voxels(const common::TriangleMesh& solid, int cells, unsigned threads) {
    constexpr int kMargin = 2;  // nodes on the grid's border count as outside
    const common::GridFrame frame =
        common::make_grid_frame(common::surface_box(solid), cells, kMargin);
    const std::vector<std::uint8_t> inside = common::voxelise_solid(solid, frame, threads);
    std::vector<float> values(inside.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = inside[i] != 0 ? -1.0f : 1.0f;
    return shape_of(common::marching_cubes(frame, values, 0.0f, threads));
}

// The nodes that a plate thinner than a cell happens to hold have some topology too: half the
// volume must be there for it to count.
bool sees(const Shape& voxels, const Shape& own) {
    return voxels.volume >= 0.5 * own.volume && voxels.volume <= 2.0 * own.volume;
}

bool alike(const MeshTopology& a, const MeshTopology& b) {
    return a.components == b.components && a.euler == b.euler && a.euler_largest == b.euler_largest;
}

std::string described(const MeshTopology& topology) {
    return std::to_string(topology.components) +
           (topology.components == 1 ? " component" : " components") + " of Euler characteristic " +
           std::to_string(topology.euler);
}

ShapePromise promise(const MeshTopology& topology) {
    ShapePromise result;
    result.components = static_cast<std::uint32_t>(topology.components);
    result.euler_all = static_cast<std::int32_t>(topology.euler);
    result.euler_largest = static_cast<std::int32_t>(topology.euler_largest);
    return result;
}

}  // namespace

ShapePromise promise_topology(const PreparedModel& model, unsigned threads) {
    // Both are mostly for one thread.
    std::future<Shape> first =
        common::beside(threads, [&] { return shape_of_voxels(model.solid, kGrids[0], threads); });
    const Shape own = shape_of(model.solid);
    Shape seen;
    for (const int cells : kGrids) {
        seen = first.valid() ? first.get() : shape_of_voxels(model.solid, cells, threads);
        if (sees(seen, own) && alike(seen.topology, own.topology)) return promise(own.topology);
    }
    const bool any = seen.topology.components > 0;
    ShapePromise result = promise(any ? seen.topology : own.topology);
    result.approximate = true;
    result.reason = "the surface has " + described(own.topology) + ", its solid on a grid of 256 " +
                    (any ? described(seen.topology) : std::string("none")) +
                    " (parts overlap or are very thin)";
    return result;
}

}  // namespace ellicast::sender
