// sender/broadcast_object.cpp
#include "sender/broadcast_object.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/diagonal_choice.hpp"
#include "common/object_id.hpp"
#include "common/random.hpp"
#include "protocol/object_table.hpp"
#include "sender/diagonal_rule.hpp"
#include "sender/importance_order.hpp"
#include "sender/spread_order.hpp"
#include "sender/surface_decimation.hpp"

namespace ellicast::sender {
namespace {

constexpr double kFloatMax = std::numeric_limits<float>::max();

/// What is subtracted on one axis before the wire. Zero unless |centre| > 3 half extents; then
/// every x lies within [2/3, 4/3] of the centre, so for float32 x and origin the difference is
/// exact (Sterbenz: y/2 <= x <= 2y makes x - y exact) and x = record + origin bit for bit. Without
/// an origin a record keeps float32 input as it is; either way the rounding error is below 4 half
/// extents * 2^-24.
/// Needed at all only where a coordinate is no float32: whoever misses every description would
/// otherwise have the model in the wrong place for nothing.
bool all_are_floats(const std::vector<Eigen::Vector3d>& positions) {
    return std::all_of(positions.begin(), positions.end(), [](const Eigen::Vector3d& x) {
        return (x.array() == x.cast<float>().cast<double>().array()).all();
    });
}

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

/// Of each record the first that is equal to it (0 and -0 are equal).
std::vector<std::uint32_t> first_equals(const std::vector<protocol::VertexRecord>& records) {
    std::vector<std::uint32_t> by_position(records.size());
    std::iota(by_position.begin(), by_position.end(), 0u);
    std::sort(by_position.begin(), by_position.end(), [&](std::uint32_t a, std::uint32_t b) {
        const auto& p = records[a].position;
        const auto& q = records[b].position;
        return p != q ? p < q : a < b;
    });
    std::vector<std::uint32_t> first(records.size());
    for (std::size_t k = 0; k < records.size(); ++k) {
        const std::uint32_t index = by_position[k];
        const bool equal = k > 0 && records[by_position[k - 1]] == records[index];
        first[index] = equal ? first[by_position[k - 1]] : index;
    }
    return first;
}

std::vector<Eigen::Vector3d> positions_of(const std::vector<protocol::VertexRecord>& records) {
    std::vector<Eigen::Vector3d> positions;
    positions.reserve(records.size());
    for (const protocol::VertexRecord& record : records) {
        positions.emplace_back(record.position[0], record.position[1], record.position[2]);
    }
    return positions;
}

std::vector<protocol::VertexRecord> picked(const std::vector<protocol::VertexRecord>& records,
                                           const std::vector<std::uint32_t>& indices) {
    std::vector<protocol::VertexRecord> result;
    result.reserve(indices.size());
    for (const std::uint32_t index : indices) result.push_back(records[index]);
    return result;
}

/// The vertices' own indices by descending importance, backwards through the decimation of the
/// solid. Where the solid has copies of a vertex, the most important one counts.
std::vector<std::uint32_t> by_importance(const PreparedModel& model,
                                         const std::vector<std::uint32_t>& first_equal) {
    std::vector<std::uint32_t> removed = removal_order(model.solid);
    std::reverse(removed.begin(), removed.end());
    std::vector<bool> taken(model.vertices.size(), false);
    std::vector<std::uint32_t> ranking;
    ranking.reserve(model.vertices.size());
    for (const std::uint32_t index : removed) {
        const std::uint32_t vertex = first_equal[index];
        if (vertex >= taken.size() || taken[vertex]) continue;  // the centre of a cap, or a copy
        taken[vertex] = true;
        ranking.push_back(vertex);
    }
    return ranking;
}

/// The records of the model's vertices, one each, and of the solid's others behind them.
std::vector<protocol::VertexRecord> solid_records(const PreparedModel& model,
                                                  const std::array<double, 3>& origin) {
    std::vector<protocol::VertexRecord> records;
    records.reserve(model.solid.positions.size());
    for (const Eigen::Vector3d& x : model.solid.positions) {
        records.push_back(vertex_record(x, origin));
    }
    return records;
}

/// Equal records of the model's vertices once, in the order asked for.
std::vector<protocol::VertexRecord> ordered_records(const PreparedModel& model,
                                                    std::vector<protocol::VertexRecord> records,
                                                    const ObjectOptions& options) {
    const std::vector<std::uint32_t> first_equal = first_equals(records);
    if (options.order == SendingOrder::importance) {
        records = picked(records, by_importance(model, first_equal));
        return picked(records, spread_within_strata(positions_of(records), options.seed));
    }
    std::vector<std::uint32_t> distinct;
    for (std::uint32_t k = 0; k < model.vertices.size(); ++k) {
        if (first_equal[k] == k) distinct.push_back(k);
    }
    records = picked(records, distinct);
    return picked(records, spread_order(positions_of(records), options.seed));
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

}  // namespace

BroadcastObject make_object(const PreparedModel& model, const ShapePromise& promise,
                            const Decomposition& decomposition, const ObjectOptions& options) {
    BroadcastObject object;
    object.description.name = options.name;
    object.description.sender_version = "ellicast " ELLICAST_VERSION;

    const Eigen::AlignedBox3d box = common::bounding_box(model.vertices);
    const bool exact = all_are_floats(model.vertices);
    for (int axis = 0; axis < 3 && !box.isEmpty() && !exact; ++axis) {
        object.description.origin[static_cast<std::size_t>(axis)] =
            origin_on_axis(box.min()[axis], box.max()[axis]);
    }
    const std::array<double, 3>& origin = object.description.origin;

    std::vector<protocol::VertexRecord> records = solid_records(model, origin);
    object.vertices = ordered_records(model, records, options);
    object.order = options.order;
    records.resize(model.vertices.size());
    object.hint.format = record_format(options.tags, model);
    set_tags(object.hint.format, model, records, object.vertices);
    static_assert(common::kDiagonalRules == protocol::kDiagonalRules);
    object.hint.by_importance = options.order == SendingOrder::importance;
    object.hint.diagonals = best_diagonal_rule(model.solid, object.hint.format.normal_bits);

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

}  // namespace ellicast::sender
