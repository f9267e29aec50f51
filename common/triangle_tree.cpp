// common/triangle_tree.cpp
#include "common/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace ellicast::common {
namespace {

using Eigen::AlignedBox3d;
using Eigen::AlignedBox3f;
using Eigen::Vector3d;

// Leaves of four: fewer make the descent longer, more test triangles in vain.
constexpr std::size_t kLeafTriangles = 4;
constexpr int kBins = 16;
// Below this depth the surface-area heuristic gives way to halving, which bounds the depth by this
// plus 32 whatever the triangles, and so the size of the query's stack.
constexpr int kMaxHeuristicDepth = 48;
constexpr std::size_t kStackSize = kMaxHeuristicDepth + 34;

// Floats that bound the box from outside.
AlignedBox3f rounded_outwards(const AlignedBox3d& box) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    AlignedBox3f result;
    for (int axis = 0; axis < 3; ++axis) {
        float low = static_cast<float>(box.min()[axis]);
        float high = static_cast<float>(box.max()[axis]);
        if (static_cast<double>(low) > box.min()[axis]) low = std::nextafter(low, -kInfinity);
        if (static_cast<double>(high) < box.max()[axis]) high = std::nextafter(high, kInfinity);
        result.min()[axis] = low;
        result.max()[axis] = high;
    }
    return result;
}

// Squared distance of x to a box. Never above the squared distance, as squared_distance() computes
// it, of any point in the box: differences, squares and sums of doubles round monotonically, and
// both sum in the same order.
double squared_distance(const Vector3d& x, const AlignedBox3f& box) {
    const Vector3d low = box.min().cast<double>();
    const Vector3d high = box.max().cast<double>();
    const double dx = std::max(0.0, std::max(low[0] - x[0], x[0] - high[0]));
    const double dy = std::max(0.0, std::max(low[1] - x[1], x[1] - high[1]));
    const double dz = std::max(0.0, std::max(low[2] - x[2], x[2] - high[2]));
    return dx * dx + dy * dy + dz * dz;
}

double squared_distance(const Vector3d& x, const Vector3d& y) {
    const double dx = x[0] - y[0];
    const double dy = x[1] - y[1];
    const double dz = x[2] - y[2];
    return dx * dx + dy * dy + dz * dz;
}

double half_area(const AlignedBox3d& box) {
    if (box.isEmpty()) return 0.0;
    const Vector3d s = box.sizes();
    return s[0] * s[1] + s[1] * s[2] + s[2] * s[0];
}

// What the build knows of a triangle.
struct Item {
    AlignedBox3d box;
    Vector3d center;
    std::uint32_t triangle = 0;
};

struct Bin {
    AlignedBox3d box;
    std::size_t count = 0;
};

// Which of the equal bins along an axis an item falls into, by its centre.
class Binning {
  public:
    Binning(const AlignedBox3d& centers, int axis)
        : axis_(axis),
          low_(centers.min()[axis]),
          scale_(kBins / (centers.max()[axis] - centers.min()[axis])) {}

    [[nodiscard]] bool valid() const { return std::isfinite(scale_); }

    [[nodiscard]] int bin_of(const Item& item) const {
        return std::clamp(static_cast<int>((item.center[axis_] - low_) * scale_), 0, kBins - 1);
    }

  private:
    int axis_;
    double low_;
    double scale_;
};

// Surface-area heuristic ([W07]): the cut between bins that makes sum of area x count least.
// Returns the first bin of the right part; 0 when there is no cut.
int best_cut(const std::array<Bin, kBins>& bins, double& least_cost) {
    std::array<double, kBins> cost_right{};
    Bin right;
    for (int b = kBins - 1; b > 0; --b) {
        const Bin& bin = bins[static_cast<std::size_t>(b)];
        right.box.extend(bin.box);
        right.count += bin.count;
        cost_right[static_cast<std::size_t>(b)] =
            right.count == 0 ? -1.0 : half_area(right.box) * static_cast<double>(right.count);
    }
    int cut = 0;
    Bin left;
    for (int b = 1; b < kBins; ++b) {
        const Bin& bin = bins[static_cast<std::size_t>(b - 1)];
        left.box.extend(bin.box);
        left.count += bin.count;
        const double of_right = cost_right[static_cast<std::size_t>(b)];
        if (left.count == 0 || of_right < 0.0) continue;
        const double cost = half_area(left.box) * static_cast<double>(left.count) + of_right;
        if (cost < least_cost) {
            least_cost = cost;
            cut = b;
        }
    }
    return cut;
}

// Splits items [first, last) in place; returns the first item of the right part.
std::size_t split(std::vector<Item>& items, std::size_t first, std::size_t last, int depth) {
    const std::size_t half = first + (last - first) / 2;
    if (depth >= kMaxHeuristicDepth) return half;
    AlignedBox3d centers;
    for (std::size_t i = first; i < last; ++i) centers.extend(items[i].center);

    double least_cost = std::numeric_limits<double>::infinity();
    int best_axis = -1;
    int cut = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const Binning binning(centers, axis);
        if (!binning.valid()) continue;
        std::array<Bin, kBins> bins;
        for (std::size_t i = first; i < last; ++i) {
            Bin& bin = bins[static_cast<std::size_t>(binning.bin_of(items[i]))];
            bin.box.extend(items[i].box);
            ++bin.count;
        }
        const int c = best_cut(bins, least_cost);
        if (c > 0) {
            best_axis = axis;
            cut = c;
        }
    }
    if (best_axis < 0) return half;  // all centres in one place
    const Binning binning(centers, best_axis);
    const auto begin = items.begin();
    const auto middle = std::partition(
        begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last),
        [&](const Item& item) { return binning.bin_of(item) < cut; });
    return static_cast<std::size_t>(middle - begin);
}

}  // namespace

struct TriangleTree::Builder {
    std::vector<Item> items;
    std::vector<Node> nodes;

    void build(std::size_t first, std::size_t last, int depth) {
        const std::size_t at = nodes.size();
        AlignedBox3d box;
        for (std::size_t i = first; i < last; ++i) box.extend(items[i].box);
        nodes.push_back({rounded_outwards(box), 0, 0});
        if (last - first <= kLeafTriangles) {
            nodes[at].first = static_cast<std::uint32_t>(first);
            nodes[at].count = static_cast<std::uint32_t>(last - first);
            return;
        }
        const std::size_t middle = split(items, first, last, depth);
        build(first, middle, depth + 1);
        nodes[at].first = static_cast<std::uint32_t>(nodes.size());
        build(middle, last, depth + 1);
    }
};

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
    const std::size_t count = mesh.triangles.size();
    assert(count < std::numeric_limits<std::uint32_t>::max());
    if (count == 0) return;
    Builder builder;
    std::vector<Item>& items = builder.items;
    items.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        for (const std::uint32_t corner : mesh.triangles[i]) {
            assert(corner < mesh.positions.size());
            items[i].box.extend(mesh.positions[corner]);
        }
        // Halves first: the sum of two large coordinates may overflow.
        items[i].center = 0.5 * items[i].box.min() + 0.5 * items[i].box.max();
        items[i].triangle = static_cast<std::uint32_t>(i);
    }
    builder.nodes.reserve(count);
    builder.build(0, count, 0);
    nodes_ = std::move(builder.nodes);

    corners_.resize(count);
    triangle_of_slot_.resize(count);
    for (std::size_t slot = 0; slot < count; ++slot) {
        triangle_of_slot_[slot] = items[slot].triangle;
        const Triangle& triangle = mesh.triangles[items[slot].triangle];
        for (std::size_t c = 0; c < 3; ++c) corners_[slot][c] = mesh.positions[triangle[c]];
    }
}

void TriangleTree::test_leaf(const Node& leaf, const Vector3d& x, Hit& best) const {
    for (std::uint32_t slot = leaf.first; slot < leaf.first + leaf.count; ++slot) {
        const auto& [a, b, c] = corners_[slot];
        const TrianglePoint hit = closest_point_on_triangle(x, a, b, c);
        const double d2 = squared_distance(x, hit.point);
        const std::uint32_t triangle = triangle_of_slot_[slot];
        if (d2 < best.squared_distance ||
            (d2 == best.squared_distance && triangle < best.triangle)) {
            best = {triangle, hit.point, hit.barycentric, d2};
        }
    }
}

TriangleTree::Hit TriangleTree::closest(const Vector3d& x, double max_squared_distance) const {
    Hit best;
    best.squared_distance = max_squared_distance;
    struct Waiting {
        std::uint32_t node;
        double squared_distance;
    };
    std::array<Waiting, kStackSize> stack;
    std::size_t waiting = 0;
    if (!nodes_.empty()) stack[waiting++] = {0, squared_distance(x, nodes_[0].box)};
    while (waiting > 0) {
        const Waiting top = stack[--waiting];
        // Equal distance is not skipped: a smaller triangle index may be in there.
        if (top.squared_distance > best.squared_distance) continue;
        std::uint32_t at = top.node;
        bool reachable = true;
        while (reachable && nodes_[at].count == 0) {
            std::uint32_t near = at + 1;
            std::uint32_t far = nodes_[at].first;
            double near2 = squared_distance(x, nodes_[near].box);
            double far2 = squared_distance(x, nodes_[far].box);
            if (far2 < near2) {
                std::swap(near, far);
                std::swap(near2, far2);
            }
            if (far2 <= best.squared_distance) stack[waiting++] = {far, far2};
            reachable = near2 <= best.squared_distance;
            at = near;
        }
        if (reachable) test_leaf(nodes_[at], x, best);
    }
    if (best.triangle == std::numeric_limits<std::uint32_t>::max()) return Hit();
    return best;
}

void TriangleTree::find_meeting(const AlignedBox3d& box,
                                std::vector<std::uint32_t>& triangles) const {
    triangles.clear();
    const auto meets = [](const AlignedBox3d& a, const AlignedBox3d& b) {
        return (a.min().array() <= b.max().array()).all() &&
               (b.min().array() <= a.max().array()).all();
    };
    std::array<std::uint32_t, kStackSize> stack;
    std::size_t waiting = 0;
    if (!nodes_.empty()) stack[waiting++] = 0;
    while (waiting > 0) {
        const std::uint32_t at = stack[--waiting];
        const Node& node = nodes_[at];
        if (!meets(box, node.box.cast<double>())) continue;
        if (node.count == 0) {
            stack[waiting++] = node.first;
            stack[waiting++] = at + 1;
            continue;
        }
        for (std::uint32_t slot = node.first; slot < node.first + node.count; ++slot) {
            const auto& [a, b, c] = corners_[slot];
            const AlignedBox3d own(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
            if (meets(box, own)) triangles.push_back(triangle_of_slot_[slot]);
        }
    }
    std::sort(triangles.begin(), triangles.end());
}

}  // namespace ellicast::common
