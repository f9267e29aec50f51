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

using Eigen::Array4f;
using Eigen::Vector3d;

// Leaves of four: fewer make the descent longer, more test triangles in vain.
constexpr std::size_t kLeafTriangles = 4;
constexpr std::size_t kBins = 8;
// Below this depth the surface-area heuristic gives way to halving, which bounds the depth by this
// plus 32 whatever the triangles, and so the size of the query's stack.
constexpr int kMaxHeuristicDepth = 48;
constexpr std::size_t kStackSize = kMaxHeuristicDepth + 34;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLargest = std::numeric_limits<float>::max();

// Four lanes are one register; the last is always 0.
Array4f four(const Vector3d& x) {
    return {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2]), 0.0F};
}

// More than what rounding a double to x changed: a unit in the last place at least, or the least of
// all floats.
Array4f last_place(const Array4f& x) {
    constexpr float kUnit = std::numeric_limits<float>::epsilon();
    constexpr float kLeast = std::numeric_limits<float>::denorm_min();
    return (kUnit * x.abs()).max(Array4f(kLeast, kLeast, kLeast, 0.0F));
}

// What is beyond all floats becomes the largest, or infinite.
Array4f rounded_down(const Vector3d& x) {
    const Array4f near = four(x).min(kLargest);
    return near - last_place(near);
}
Array4f rounded_up(const Vector3d& x) {
    const Array4f near = four(x).max(-kLargest);
    return near + last_place(near);
}

struct Box {
    Array4f low = Array4f::Constant(kInfinity);
    Array4f high = Array4f::Constant(-kInfinity);

    void extend(const Box& other) {
        low = low.min(other.low);
        high = high.max(other.high);
    }
    void extend(const Array4f& x) {
        low = low.min(x);
        high = high.max(x);
    }
};

// Not of an empty one.
float half_area(const Box& box) {
    const Array4f s = box.high - box.low;
    return s[0] * s[1] + s[1] * s[2] + s[2] * s[0];
}

// Squared distance of x to a box. Never above the squared distance, as the function below computes
// it, of any point in the box: differences, squares and sums of doubles round monotonically, and
// both sum in the same order.
double squared_distance(const Vector3d& x, const Vector3d& low, const Vector3d& high) {
    const double dx = std::max(0.0, std::max(low[0] - x[0], x[0] - high[0]));
    const double dy = std::max(0.0, std::max(low[1] - x[1], x[1] - high[1]));
    const double dz = std::max(0.0, std::max(low[2] - x[2], x[2] - high[2]));
    return dx * dx + dy * dy + dz * dz;
}
double squared_distance(const Vector3d& x, const Array4f& box_low, const Array4f& box_high) {
    const Vector3d low = box_low.head<3>().cast<double>();
    const Vector3d high = box_high.head<3>().cast<double>();
    return squared_distance(x, low, high);
}

double squared_distance(const Vector3d& x, const Vector3d& y) {
    const double dx = x[0] - y[0];
    const double dy = x[1] - y[1];
    const double dz = x[2] - y[2];
    return dx * dx + dy * dy + dz * dz;
}

// What the build knows of a triangle.
struct Item {
    Box box;  // rounded outwards
    std::uint32_t triangle = 0;

    [[nodiscard]] Array4f center() const { return 0.5F * box.low + 0.5F * box.high; }
};

// Items that lie together, and the boxes around them and around their centres.
struct Part {
    std::size_t first = 0;
    std::size_t last = 0;
    Box box;
    Box centers;

    void add(const Item& item) {
        ++last;
        box.extend(item.box);
        centers.extend(item.center());
    }
    // What is in `other` lies behind this.
    void append(const Part& other) {
        last += other.last - other.first;
        box.extend(other.box);
        centers.extend(other.centers);
    }
    [[nodiscard]] std::size_t size() const { return last - first; }
    [[nodiscard]] float cost() const { return half_area(box) * static_cast<float>(size()); }
};

using Bins = std::array<Part, kBins>;

// Which of the equal bins along the longest axis of the centres an item falls into.
class Binning {
  public:
    explicit Binning(const Box& centers) {
        const float length = (centers.high - centers.low).maxCoeff(&axis_);
        low_ = centers.low[axis_];
        scale_ = static_cast<float>(kBins) / length;
    }

    // Not where all centres lie in one place.
    [[nodiscard]] bool valid() const { return scale_ > 0.0F && scale_ <= kLargest; }

    [[nodiscard]] std::size_t bin_of(const Item& item) const {
        const float at = 0.5F * item.box.low[axis_] + 0.5F * item.box.high[axis_];
        return std::min(static_cast<std::size_t>((at - low_) * scale_), kBins - 1);
    }

  private:
    Eigen::Index axis_ = 0;
    float low_ = 0.0F;
    float scale_ = 0.0F;
};

// Surface-area heuristic ([W07]): the cut between bins that makes the sum of area x count least.
// Returns the first bin of the right part; 0 when there is no cut.
std::size_t best_cut(const Bins& bins) {
    std::array<float, kBins> cost_right{};
    Part right;
    for (std::size_t b = kBins - 1; b > 0; --b) {
        right.append(bins[b]);
        cost_right[b] = right.size() == 0 ? kInfinity : right.cost();
    }
    std::size_t cut = 0;
    float least_cost = kInfinity;
    Part left;
    for (std::size_t b = 1; b < kBins; ++b) {
        left.append(bins[b - 1]);
        if (left.size() == 0) continue;
        const float cost = left.cost() + cost_right[b];
        if (cost < least_cost) {
            least_cost = cost;
            cut = b;
        }
    }
    return cut;
}

}  // namespace

struct TriangleTree::Builder {
    std::vector<Item> items;
    std::vector<Node> nodes;

    void build(const Part& part, int depth) {
        const std::size_t at = nodes.size();
        nodes.push_back({part.box.low, part.box.high, 0, 0});
        if (part.size() <= kLeafTriangles) {
            nodes[at].first = static_cast<std::uint32_t>(part.first);
            nodes[at].count = static_cast<std::uint32_t>(part.size());
            return;
        }
        const auto [left, right] = split(part, depth);
        build(left, depth + 1);
        nodes[at].first = static_cast<std::uint32_t>(nodes.size());
        build(right, depth + 1);
    }

    // Reorders the items of the part.
    std::pair<Part, Part> split(const Part& part, int depth) {
        const Binning binning(part.centers);
        if (depth >= kMaxHeuristicDepth || !binning.valid()) return halves(part);
        Bins bins;
        for (std::size_t i = part.first; i < part.last; ++i) {
            bins[binning.bin_of(items[i])].add(items[i]);
        }
        const std::size_t cut = best_cut(bins);
        if (cut == 0) return halves(part);
        const auto begin = items.begin();
        std::partition(begin + static_cast<std::ptrdiff_t>(part.first),
                       begin + static_cast<std::ptrdiff_t>(part.last),
                       [&](const Item& item) { return binning.bin_of(item) < cut; });
        Part left{part.first, part.first, {}, {}};
        for (std::size_t b = 0; b < cut; ++b) left.append(bins[b]);
        Part right{left.last, left.last, {}, {}};
        for (std::size_t b = cut; b < kBins; ++b) right.append(bins[b]);
        return {left, right};
    }

    [[nodiscard]] std::pair<Part, Part> halves(const Part& part) const {
        const std::size_t half = part.first + part.size() / 2;
        return {part_of(part.first, half), part_of(half, part.last)};
    }

    [[nodiscard]] Part part_of(std::size_t first, std::size_t last) const {
        Part part{first, first, {}, {}};
        for (std::size_t i = first; i < last; ++i) part.add(items[i]);
        return part;
    }
};

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
    const std::size_t count = mesh.triangles.size();
    assert(count < std::numeric_limits<std::uint32_t>::max());
    if (count == 0) return;
    Builder builder;
    std::vector<Item>& items = builder.items;
    items.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto& [a, b, c] = mesh.triangles[i];
        assert(std::max({a, b, c}) < mesh.positions.size());
        const Vector3d& p = mesh.positions[a];
        const Vector3d& q = mesh.positions[b];
        const Vector3d& r = mesh.positions[c];
        items.push_back(
            {{rounded_down(p.cwiseMin(q).cwiseMin(r)), rounded_up(p.cwiseMax(q).cwiseMax(r))},
             static_cast<std::uint32_t>(i)});
    }
    builder.nodes.reserve(count);
    builder.build(builder.part_of(0, count), 0);
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
        // The point that is closest never leaves the box.
        const Vector3d low = a.cwiseMin(b).cwiseMin(c);
        const Vector3d high = a.cwiseMax(b).cwiseMax(c);
        const double at_least = squared_distance(x, low, high);
        if (at_least > best.squared_distance) continue;
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
    if (!nodes_.empty()) stack[waiting++] = {0, squared_distance(x, nodes_[0].low, nodes_[0].high)};
    while (waiting > 0) {
        const Waiting top = stack[--waiting];
        // Equal distance is not skipped: a smaller triangle index may be in there.
        if (top.squared_distance > best.squared_distance) continue;
        std::uint32_t at = top.node;
        bool reachable = true;
        while (reachable && nodes_[at].count == 0) {
            std::uint32_t near = at + 1;
            std::uint32_t far = nodes_[at].first;
            double near2 = squared_distance(x, nodes_[near].low, nodes_[near].high);
            double far2 = squared_distance(x, nodes_[far].low, nodes_[far].high);
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

}  // namespace ellicast::common
