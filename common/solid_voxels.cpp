// common/solid_voxels.cpp
#include "common/solid_voxels.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "common/mesh_topology.hpp"
#include "common/parallel.hpp"

// How a row of nodes finds its crossings so that no shared edge or vertex counts twice or never:
// A vertex with z equal to that of a slice counts as below it, so a triangle meets the slice in one
// edge that goes up and one that goes down, or not at all. The point where the slice meets an edge
// is computed from the lower end to the upper, hence with the same bits in both triangles of the
// edge: in the slice, a closed mesh is a set of closed polygons. A corner of these with y equal to
// that of a row counts as below it in the same way, so the signed crossings of any row add up to
// zero, in exact arithmetic or not. Only where a crossing lies along x is subject to rounding.

namespace ellicast::common {
namespace {

using Eigen::Vector3d;

// One axis of a grid.
struct Axis {
    double origin;
    double spacing;
    int count;

    Axis(const GridFrame& frame, int axis)
        : origin(frame.origin[axis]),
          spacing(frame.spacing),
          count(frame.dims[static_cast<std::size_t>(axis)]) {}

    // The same bits as GridFrame::position().
    [[nodiscard]] double at(int i) const { return origin + spacing * i; }

    // The first node that is not below `value`, in [0, count].
    [[nodiscard]] int first_from(double value) const {
        const double guess = std::ceil((value - origin) / spacing);
        int i = 0;
        if (guess > 0.0) i = guess < count ? static_cast<int>(guess) : count;
        // The guess is rounded: let the nodes themselves decide.
        while (i > 0 && at(i - 1) >= value) --i;
        while (i < count && at(i) < value) ++i;
        return i;
    }
};

struct Range {
    int first = 0;
    int last = 0;  // exclusive
};

// The slices that each triangle meets.
std::vector<Range> slices_of_triangles(const TriangleMesh& mesh, const Axis& z_axis) {
    std::vector<Range> slices;
    slices.reserve(mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles) {
        assert(std::max({a, b, c}) < mesh.positions.size());
        const auto [low, high] =
            std::minmax({mesh.positions[a][2], mesh.positions[b][2], mesh.positions[c][2]});
        slices.push_back({z_axis.first_from(low), z_axis.first_from(high)});
    }
    return slices;
}

// Where an edge meets a slice.
struct Corner {
    double x = 0;
    double y = 0;
};

// Requires p.z <= z < q.z.
Corner edge_in_slice(const Vector3d& p, const Vector3d& q, double z) {
    const double t = (z - p[2]) / (q[2] - p[2]);
    return {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])};
}

// Rasterises slices of the solid one after the other.
class SliceRasteriser {
  public:
    explicit SliceRasteriser(const GridFrame& frame)
        : x_axis_(frame, 0),
          y_axis_(frame, 1),
          winding_steps_(static_cast<std::size_t>(x_axis_.count) *
                         static_cast<std::size_t>(y_axis_.count)) {}

    // Requires that the triangle meets the slice.
    void add_triangle(const TriangleMesh& mesh, const Triangle& triangle, double z) {
        Corner up, down;
        for (std::size_t c = 0; c < 3; ++c) {
            const Vector3d& p = mesh.positions[triangle[c]];
            const Vector3d& q = mesh.positions[triangle[(c + 1) % 3]];
            if (p[2] <= z && z < q[2]) up = edge_in_slice(p, q, z);
            if (q[2] <= z && z < p[2]) down = edge_in_slice(q, p, z);
        }
        if (up.y < down.y) {
            add_segment(up, down, 1);
        } else {
            add_segment(down, up, -1);
        }
    }

    // Writes 0 or 1 for every node of the slice, and starts afresh.
    void finish(std::uint8_t* nodes) {
        const auto width = static_cast<std::size_t>(x_axis_.count);
        for (std::size_t row = 0; row < winding_steps_.size(); row += width) {
            std::int32_t winding = 0;
            for (std::size_t i = row; i < row + width; ++i) {
                winding += winding_steps_[i];
                winding_steps_[i] = 0;
                nodes[i] = winding != 0 ? 1 : 0;
            }
        }
    }

  private:
    // Adds `sign` to the winding number of all nodes beyond the segment, low.y <= high.y.
    void add_segment(const Corner& low, const Corner& high, std::int32_t sign) {
        const int last = y_axis_.first_from(high.y);
        for (int j = y_axis_.first_from(low.y); j < last; ++j) {
            const double t = (y_axis_.at(j) - low.y) / (high.y - low.y);
            const int i = x_axis_.first_from(low.x + t * (high.x - low.x));
            if (i == x_axis_.count) continue;
            winding_steps_[static_cast<std::size_t>(i) + static_cast<std::size_t>(x_axis_.count) *
                                                             static_cast<std::size_t>(j)] += sign;
        }
    }

    Axis x_axis_;
    Axis y_axis_;
    std::vector<std::int32_t> winding_steps_;  // per node: what changes from the node before it
};

// Triangles of the slab [first, last) in order of the first slice in it that they meet.
std::vector<std::uint32_t> triangles_by_slice(const std::vector<Range>& slices, Range slab) {
    const auto start_of = [&](const Range& r) {
        return static_cast<std::size_t>(std::max(r.first, slab.first) - slab.first);
    };
    const auto meets = [&](const Range& r) {
        return std::max(r.first, slab.first) < std::min(r.last, slab.last);
    };
    std::vector<std::size_t> next(static_cast<std::size_t>(slab.last - slab.first) + 1, 0);
    for (const Range& r : slices) {
        if (meets(r)) ++next[start_of(r) + 1];
    }
    for (std::size_t k = 1; k < next.size(); ++k) next[k] += next[k - 1];
    std::vector<std::uint32_t> sorted(next.back());
    for (std::size_t i = 0; i < slices.size(); ++i) {
        if (meets(slices[i])) sorted[next[start_of(slices[i])]++] = static_cast<std::uint32_t>(i);
    }
    return sorted;
}

void voxelise_slab(const TriangleMesh& mesh, const GridFrame& frame,
                   const std::vector<Range>& slices, Range slab, std::uint8_t* nodes) {
    const Axis z_axis(frame, 2);
    const std::size_t slice_size = frame.index(0, 0, 1);
    const std::vector<std::uint32_t> waiting = triangles_by_slice(slices, slab);
    auto next = waiting.begin();
    std::vector<std::uint32_t> active;
    SliceRasteriser rasteriser(frame);
    for (int k = slab.first; k < slab.last; ++k) {
        std::erase_if(active, [&](std::uint32_t i) { return slices[i].last <= k; });
        while (next != waiting.end() && slices[*next].first <= k) active.push_back(*next++);
        for (const std::uint32_t i : active) {
            rasteriser.add_triangle(mesh, mesh.triangles[i], z_axis.at(k));
        }
        rasteriser.finish(nodes + slice_size * static_cast<std::size_t>(k));
    }
}

}  // namespace

GridFrame make_grid_frame(const Eigen::AlignedBox3d& box, int cells, int margin) {
    assert(!box.isEmpty() && box.min().allFinite() && box.max().allFinite());
    assert(cells >= 1 && margin >= 0);
    const Vector3d size = box.sizes();
    assert(size.maxCoeff() > 0.0);
    GridFrame frame;
    frame.spacing = size.maxCoeff() / cells;
    frame.origin = box.min() - Vector3d::Constant(frame.spacing * margin);
    for (int axis = 0; axis < 3; ++axis) {
        // A billionth of a cell of slack, so that rounding adds no cell to an axis as long as
        // another.
        const double across = std::ceil(size[axis] / frame.spacing - 1e-9);
        frame.dims[static_cast<std::size_t>(axis)] =
            std::max(1, static_cast<int>(across)) + 2 * margin + 1;
    }
    return frame;
}

std::vector<std::uint8_t> voxelise_solid(const TriangleMesh& mesh, const GridFrame& frame,
                                         unsigned threads) {
    assert(frame.spacing > 0.0);
    std::vector<std::uint8_t> nodes(frame.size());
    if (nodes.empty()) return nodes;
    const std::vector<Range> slices = slices_of_triangles(mesh, Axis(frame, 2));
    parallel_for(static_cast<std::size_t>(frame.dims[2]), threads,
                 [&](std::size_t begin, std::size_t end) {
                     const Range slab{static_cast<int>(begin), static_cast<int>(end)};
                     voxelise_slab(mesh, frame, slices, slab, nodes.data());
                 });
    return nodes;
}

double volume_overlap(const TriangleMesh& a, const TriangleMesh& b, int cells, unsigned threads) {
    Eigen::AlignedBox3d box = surface_box(a);
    box.extend(surface_box(b));
    if (box.isEmpty() || !(box.sizes().maxCoeff() > 0.0)) return 1.0;
    // Nodes in the middle of cells, so that each stands for its cell's volume.
    GridFrame frame = make_grid_frame(box, cells, 0);
    frame.origin += Vector3d::Constant(0.5 * frame.spacing);
    for (int& n : frame.dims) --n;
    const std::vector<std::uint8_t> in_a = voxelise_solid(a, frame, threads);
    const std::vector<std::uint8_t> in_b = voxelise_solid(b, frame, threads);
    std::size_t both = 0;
    std::size_t either = 0;
    for (std::size_t i = 0; i < in_a.size(); ++i) {
        both += in_a[i] & in_b[i];
        either += in_a[i] | in_b[i];
    }
    return either == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(either);
}

}  // namespace ellicast::common
