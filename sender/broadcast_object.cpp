// sender/broadcast_object.cpp
#include "sender/broadcast_object.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/diagonal_choice.hpp"
#include "common/object_id.hpp"
#include "common/random.hpp"
#include "protocol/object_table.hpp"
#include "sender/costly_edges.hpp"
#include "sender/diagonal_marks.hpp"
#include "sender/diagonal_quads.hpp"
#include "sender/diagonal_rule.hpp"
#include "sender/equal_positions.hpp"
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

std::vector<Eigen::Vector3d> positions_of(const std::vector<protocol::VertexRecord>& records) {
    std::vector<Eigen::Vector3d> positions;
    positions.reserve(records.size());
    for (const protocol::VertexRecord& record : records) {
        positions.emplace_back(record.position[0], record.position[1], record.position[2]);
    }
    return positions;
}

template <class Item>
std::vector<Item> picked(const std::vector<Item>& items,
                         const std::vector<std::uint32_t>& indices) {
    std::vector<Item> result;
    result.reserve(indices.size());
    for (const std::uint32_t index : indices) result.push_back(items[index]);
    return result;
}

/// The indices of the model's own vertices, the first of the solid, by descending importance:
/// backwards through the decimation of the solid. Where that has copies of a vertex, the most
/// important one counts.
std::vector<std::uint32_t> by_importance(const common::TriangleMesh& solid, std::size_t own,
                                         const std::vector<std::uint32_t>& first_equal,
                                         unsigned threads) {
    std::vector<std::uint32_t> removed = removal_order(solid, threads);
    std::reverse(removed.begin(), removed.end());
    std::vector<bool> taken(own, false);
    std::vector<std::uint32_t> ranking;
    ranking.reserve(own);
    for (const std::uint32_t index : removed) {
        const std::uint32_t vertex = first_equal[index];
        if (vertex >= taken.size() || taken[vertex]) continue;  // the centre of a cap, or a copy
        taken[vertex] = true;
        ranking.push_back(vertex);
    }
    return ranking;
}

/// What becomes of the solid's positions: those of the model's vertices come first.
std::vector<protocol::VertexRecord> solid_records(const common::TriangleMesh& solid,
                                                  const std::array<double, 3>& origin) {
    std::vector<protocol::VertexRecord> records;
    records.reserve(solid.positions.size());
    for (const Eigen::Vector3d& x : solid.positions) {
        records.push_back(vertex_record(x, origin));
    }
    return records;
}

/// Of the model's own vertices with equal records the first ones, in the order asked for.
std::vector<std::uint32_t> ordered_vertices(const common::TriangleMesh& solid, std::size_t own,
                                            const VertexRecords& vertices,
                                            const ObjectOptions& options) {
    std::vector<std::uint32_t> order;
    if (options.order == SendingOrder::importance) {
        order = by_importance(solid, own, vertices.first_equal, options.threads);
    } else {
        for (std::uint32_t v = 0; v < own; ++v) {
            if (vertices.first_equal[v] == v) order.push_back(v);
        }
    }
    const std::vector<Eigen::Vector3d> positions = positions_of(picked(vertices.records, order));
    return picked(order, options.order == SendingOrder::importance
                             ? spread_within_strata(positions, options.seed)
                             : spread_order(positions, options.seed));
}

// Strata below are too coarse for a mesh, and above the decimation takes its time.
constexpr std::uint32_t kSmallestLevel = 512;
constexpr std::uint32_t kLargestWithLevels = 1u << 18;

/// The solid with the records' positions, and with those that no record has, centres of caps,
/// behind them. `record_of`: by position of the solid, of which the first `own` have records.
common::TriangleMesh sent_surface(common::TriangleMesh solid, std::size_t own,
                                  std::vector<std::uint32_t> record_of,
                                  const BroadcastObject& object) {
    const Eigen::Map<const Eigen::Vector3d> origin(object.description.origin.data());
    const std::vector<Eigen::Vector3d> centres(
        solid.positions.begin() + static_cast<std::ptrdiff_t>(own), solid.positions.end());
    solid.positions = {};
    common::TriangleMesh surface{positions_of(object.vertices), std::move(solid.triangles)};
    surface.positions.reserve(surface.positions.size() + centres.size());
    for (std::size_t v = own; v < record_of.size(); ++v) {
        record_of[v] = static_cast<std::uint32_t>(surface.positions.size());
        surface.positions.push_back(centres[v - own] - origin);
    }
    for (common::Triangle& t : surface.triangles) {
        t = {record_of[t[0]], record_of[t[1]], record_of[t[2]]};
    }
    std::erase_if(surface.triangles, [](const common::Triangle& t) {
        return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    });
    return surface;
}

std::vector<protocol::EdgeRecord> edges_worth_telling(common::TriangleMesh surface,
                                                      const BroadcastObject& object,
                                                      unsigned threads) {
    const auto vertices = static_cast<std::uint32_t>(object.vertices.size());
    CostlyEdgeOptions options;
    options.threads = threads;
    options.normal_bits = object.hint.format.normal_bits;
    options.diagonal_rule = object.hint.diagonals;
    if (object.order == SendingOrder::importance && vertices <= kLargestWithLevels) {
        for (const std::uint32_t end : importance_strata(vertices)) {
            if (end >= kSmallestLevel && end < vertices) options.levels.push_back(end);
        }
    }
    options.levels.push_back(vertices);
    return costly_edges(std::move(surface), vertices, options);
}

/// Sets the rule for diagonals; says which normals are to be marked, if there are tags.
std::vector<char> set_diagonals(VertexRecords& vertices, const common::TriangleMesh& solid,
                                unsigned threads) {
    const int normal_bits = vertices.format.normal_bits;
    const std::vector<Eigen::Vector3d> normals = received_normals(solid, normal_bits, threads);
    const Quads quads(solid, normals, threads);
    static_assert(common::kDiagonalRules == protocol::kDiagonalRules);
    const RuleCosts costs = rule_costs(solid, quads, normal_bits > 0, threads);
    vertices.diagonals = best_diagonal_rule(costs);
    if (normal_bits == 0) return {};
    return diagonal_marks(solid, quads, vertices.diagonals, costs[vertices.diagonals], threads);
}

/// Fills the object's records of vertices, and its edges. Requires origin, format and rule for
/// diagonals. Gives up what it needs no more as soon as it can.
void set_vertices(BroadcastObject& object, PreparedModel model, VertexRecords vertices,
                  const ObjectOptions& options) {
    const std::size_t own = std::exchange(model.vertices, {}).size();
    if (!object.hint.format.ring) model.faces = {};
    std::vector<std::uint32_t> order = ordered_vertices(model.solid, own, vertices, options);
    object.vertices = picked(vertices.records, order);
    vertices.records = {};
    std::vector<std::uint32_t> rank(model.solid.positions.size(), 0);
    for (std::uint32_t k = 0; k < order.size(); ++k) rank[order[k]] = k;
    order = {};
    std::vector<std::uint32_t> record_of = std::move(vertices.first_equal);
    for (std::uint32_t& v : record_of) v = rank[v];
    rank = {};
    if (object.hint.format.ring) set_rings(model.faces, record_of, object.vertices);
    model.faces = {};
    if (!options.tags.edges) return;
    common::TriangleMesh surface =
        sent_surface(std::move(model.solid), own, std::move(record_of), object);
    object.edges = edges_worth_telling(std::move(surface), object, options.threads);
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

VertexRecords vertex_records(const PreparedModel& model, const ObjectOptions& options) {
    VertexRecords vertices;
    const Eigen::AlignedBox3d box = common::bounding_box(model.vertices);
    const bool exact = all_are_floats(model.vertices);
    for (int axis = 0; axis < 3 && !box.isEmpty() && !exact; ++axis) {
        vertices.origin[static_cast<std::size_t>(axis)] =
            origin_on_axis(box.min()[axis], box.max()[axis]);
    }
    vertices.format = record_format(options.tags, model);
    const std::vector<char> marks = set_diagonals(vertices, model.solid, options.threads);
    vertices.records = solid_records(model.solid, vertices.origin);
    vertices.first_equal = first_equals(vertices.records.size(), [&](std::size_t k) {
        const auto& [x, y, z] = vertices.records[k].position;
        return std::array<double, 3>{x, y, z};
    });
    set_tags(vertices.format, model, vertices.first_equal, marks, vertices.records);
    return vertices;
}

BroadcastObject make_object(PreparedModel model, VertexRecords vertices,
                            const ShapePromise& promise, const Decomposition& decomposition,
                            const ObjectOptions& options) {
    BroadcastObject object;
    object.description.name = options.name;
    object.description.sender_version = "ellicast " ELLICAST_VERSION;
    object.description.origin = vertices.origin;
    object.order = options.order;
    object.hint.format = vertices.format;
    object.hint.diagonals = vertices.diagonals;
    object.hint.by_importance = options.order == SendingOrder::importance;
    set_vertices(object, std::move(model), std::move(vertices), options);

    object.hint.components = promise.components;
    object.hint.euler_all = promise.euler_all;
    object.hint.euler_largest = promise.euler_largest;
    object.hint.approximate = promise.approximate;
    object.hint.vertices = static_cast<std::uint32_t>(object.vertices.size());
    if (!object.vertices.empty()) set_box(object.hint, object.vertices);
    check(object);

    for (const common::Ellipsoid& ellipsoid : decomposition.ellipsoids) {
        const protocol::EllipsoidRecord record =
            ellipsoid_record(ellipsoid, object.description.origin);
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

BroadcastObject make_object(PreparedModel model, const ShapePromise& promise,
                            const Decomposition& decomposition, const ObjectOptions& options) {
    VertexRecords vertices = vertex_records(model, options);
    return make_object(std::move(model), std::move(vertices), promise, decomposition, options);
}

}  // namespace ellicast::sender
