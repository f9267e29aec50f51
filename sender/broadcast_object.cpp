// sender/broadcast_object.cpp
#include "sender/broadcast_object.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/object_id.hpp"
#include "common/random.hpp"
#include "protocol/object_table.hpp"

namespace ellicast::sender {
namespace {

constexpr double kFloatMax = std::numeric_limits<float>::max();

/// What is subtracted on one axis before the wire. Zero unless |centre| > 3 half extents; then
/// every x lies within [2/3, 4/3] of the centre, so for float32 x and origin the difference is
/// exact (Sterbenz: y/2 <= x <= 2y makes x - y exact) and x = record + origin bit for bit. Without
/// an origin a record keeps float32 input as it is; either way the rounding error is below 4 half
/// extents * 2^-24.
double origin_on_axis(double low, double high) {
    const double half = 0.5 * high - 0.5 * low;
    const double center = 0.5 * low + 0.5 * high;
    if (!(std::abs(center) > 3.0 * half)) return 0.0;
    if (std::abs(center) > kFloatMax) return center;
    const double rounded = static_cast<double>(static_cast<float>(center));
    // Of float32 input one end of the range lies within `half` of the centre, hence its float32
    // neighbour too. Farther than that means double input whose extent float32 does not resolve.
    return std::abs(rounded - center) > half ? center : rounded;
}

float to_wire(double value) {
    if (!(std::abs(value) <= kFloatMax)) {
        throw std::invalid_argument("coordinates are larger than 32-bit floats can hold");
    }
    return static_cast<float>(value);
}

protocol::VertexRecord vertex_record(const Eigen::Vector3d& x,
                                     const std::array<double, 3>& origin) {
    protocol::VertexRecord record;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        record.position[i] = to_wire(x[axis] - origin[i]);
    }
    return record;
}

protocol::EllipsoidRecord ellipsoid_record(const common::Ellipsoid& ellipsoid,
                                           const std::array<double, 3>& origin) {
    protocol::EllipsoidRecord record;
    std::size_t slot = 0;
    for (int axis = 0; axis < 3; ++axis, ++slot) {
        record.scalars[slot] = to_wire(ellipsoid.center[axis] - origin[slot]);
    }
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column <= row; ++column, ++slot) {
            record.scalars[slot] = to_wire(ellipsoid.L(row, column));
        }
    }
    return record;
}

/// Keeps the first of all records with equal positions (0 and -0 are equal), order otherwise kept.
std::vector<protocol::VertexRecord> without_repeats(
    const std::vector<protocol::VertexRecord>& records) {
    std::vector<std::uint32_t> by_position(records.size());
    std::iota(by_position.begin(), by_position.end(), 0u);
    std::sort(by_position.begin(), by_position.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto& p = records[a].position;
        const auto& q = records[b].position;
        return p != q ? p < q : a < b;
    });
    std::vector<bool> repeated(records.size(), false);
    for (std::size_t k = 1; k < by_position.size(); ++k) {
        repeated[by_position[k]] = records[by_position[k - 1]] == records[by_position[k]];
    }
    std::vector<protocol::VertexRecord> kept;
    kept.reserve(records.size());
    for (std::size_t k = 0; k < records.size(); ++k) {
        if (!repeated[k]) kept.push_back(records[k]);
    }
    return kept;
}

std::vector<protocol::VertexRecord> in_spread_order(
    const std::vector<protocol::VertexRecord>& records, std::uint64_t seed) {
    std::vector<Eigen::Vector3d> positions;
    positions.reserve(records.size());
    for (const protocol::VertexRecord& record : records) {
        positions.emplace_back(record.position[0], record.position[1], record.position[2]);
    }
    std::vector<protocol::VertexRecord> ordered;
    ordered.reserve(records.size());
    for (const std::uint32_t index : spread_order(positions, seed)) {
        ordered.push_back(records[index]);
    }
    return ordered;
}

/// The box of the records themselves: rounding happened before, so it holds every one of them
/// exactly.
void set_box(protocol::Hint& hint, const std::vector<protocol::VertexRecord>& records) {
    hint.box_min = hint.box_max = records.front().position;
    for (const protocol::VertexRecord& record : records) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            hint.box_min[axis] = std::min(hint.box_min[axis], record.position[axis]);
            hint.box_max[axis] = std::max(hint.box_max[axis], record.position[axis]);
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        hint.box_min[axis] += 0.0f;  // -0 becomes 0, lest the order of equal zeros enters the id
        hint.box_max[axis] += 0.0f;
    }
}

void check(const BroadcastObject& object) {
    if (object.vertices.empty()) throw std::invalid_argument("the model has no vertices to send");
    if (object.vertices.size() > protocol::kMaxVertices) {
        throw std::invalid_argument("the model has more than " +
                                    std::to_string(protocol::kMaxVertices) + " vertices");
    }
    // The box holds every vertex by construction, so one refusal means that the hint itself is
    // refused.
    if (!protocol::acceptable(object.vertices.front(), object.hint)) {
        throw std::invalid_argument(
            "the model's size or topology is beyond what the wire can promise");
    }
}

/// Spreads the lower 21 bits of x to every third bit.
std::uint64_t every_third_bit(std::uint64_t x) {
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    x = (x | x << 2) & 0x1249249249249249u;
    return x;
}

/// Indices along a Morton curve through the bounding cube, 2^21 cells an axis; ties by index.
std::vector<std::uint32_t> morton_order(const std::vector<Eigen::Vector3d>& positions) {
    const Eigen::AlignedBox3d box = common::bounding_box(positions);
    const double longest = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
    const double scale = longest > 0.0 ? ((1 << 21) - 1) / longest : 0.0;
    struct Key {
        std::uint64_t code;
        std::uint32_t index;
    };
    std::vector<Key> keys;
    keys.reserve(positions.size());
    for (const Eigen::Vector3d& p : positions) {
        std::uint64_t code = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const auto cell = static_cast<std::uint64_t>((p[axis] - box.min()[axis]) * scale);
            code |= every_third_bit(cell) << axis;
        }
        keys.push_back({code, static_cast<std::uint32_t>(keys.size())});
    }
    std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        return a.code != b.code ? a.code < b.code : a.index < b.index;
    });
    std::vector<std::uint32_t> order;
    order.reserve(keys.size());
    for (const Key& key : keys) order.push_back(key.index);
    return order;
}

}  // namespace

BroadcastObject make_object(const PreparedModel& model, const ShapePromise& promise,
                            const Decomposition& decomposition, const ObjectOptions& options) {
    BroadcastObject object;
    object.description.name = options.name;
    object.description.sender_version = "ellicast " ELLICAST_VERSION;

    const Eigen::AlignedBox3d box = common::bounding_box(model.vertices);
    for (int axis = 0; axis < 3 && !box.isEmpty(); ++axis) {
        object.description.origin[static_cast<std::size_t>(axis)] =
            origin_on_axis(box.min()[axis], box.max()[axis]);
    }
    const std::array<double, 3>& origin = object.description.origin;

    std::vector<protocol::VertexRecord> records;
    records.reserve(model.vertices.size());
    for (const Eigen::Vector3d& x : model.vertices) records.push_back(vertex_record(x, origin));
    object.vertices = in_spread_order(without_repeats(records), options.seed);
    object.hint.format = record_format(options.tags, model);
    set_tags(object.hint.format, model, records, object.vertices);

    object.hint.components = promise.components;
    object.hint.euler_all = promise.euler_all;
    object.hint.euler_largest = promise.euler_largest;
    object.hint.approximate = promise.approximate;
    object.hint.vertices = static_cast<std::uint32_t>(object.vertices.size());
    if (!object.vertices.empty()) set_box(object.hint, object.vertices);
    check(object);

    for (const common::Ellipsoid& ellipsoid : decomposition.ellipsoids) {
        const protocol::EllipsoidRecord record = ellipsoid_record(ellipsoid, origin);
        if (protocol::acceptable(record, object.hint)) object.ellipsoids.push_back(record);
    }
    if (object.ellipsoids.empty()) {
        throw std::invalid_argument("the model has no ellipsoids to send");
    }
    if (object.ellipsoids.size() > protocol::kMaxEllipsoids) {
        throw std::invalid_argument("more than " + std::to_string(protocol::kMaxEllipsoids) +
                                    " ellipsoids");
    }
    object.hint.ellipsoids = static_cast<std::uint16_t>(object.ellipsoids.size());
    object.id =
        protocol::object_id_of<common::Digest>(object.hint, object.ellipsoids, object.vertices);
    return object;
}

std::vector<std::uint32_t> spread_order(const std::vector<Eigen::Vector3d>& positions,
                                        std::uint64_t seed) {
    const std::vector<std::uint32_t> along_curve = morton_order(positions);
    const std::size_t count = along_curve.size();

    // A binary tree over the ranks: every node halves its range. Which half is visited first is a
    // coin tossed once per node; that one is the larger of an odd range. The root is node 1, the
    // half of node n that is visited first (second) is node 2n (2n + 1).
    common::Random random(seed);
    std::vector<bool> right_first(std::bit_ceil(count + 1), false);
    for (std::size_t node = 0; node < right_first.size(); ++node) {
        right_first[node] = (random.next() >> 63) != 0;
    }

    // Bit j of the visit's number chooses the half at depth j. So the visits 0..2^d-1, and every
    // later aligned run of 2^d, enter each of the 2^d ranges of depth d once; and a stride that is
    // odd keeps that, since it runs through all residues of 2^d.
    std::vector<std::uint32_t> order(count);
    for (std::size_t visit = 0; visit < count; ++visit) {
        std::size_t begin = 0;
        std::size_t size = count;
        std::size_t node = 1;
        for (std::size_t bits = visit; size > 1; bits >>= 1) {
            const bool second = (bits & 1) != 0;
            const bool right = second != right_first[node];
            const std::size_t part = second ? size / 2 : size - size / 2;
            if (right) begin += size - part;
            size = part;
            node = 2 * node + (second ? 1 : 0);
        }
        order[visit] = along_curve[begin];
    }
    return order;
}

}  // namespace ellicast::sender
