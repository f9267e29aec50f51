// tests/sender/broadcast_object_test.cpp
#include "sender/broadcast_object.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "common/object_id.hpp"
#include "protocol/object_table.hpp"
#include "sender/spread_order.hpp"
#include "tests/sender/made_objects.hpp"

namespace ellicast::sender {
namespace {

using tests::balls_in;
using tests::model_of;
using tests::sphere_points;

Eigen::Vector3d restored(const BroadcastObject& object, const protocol::VertexRecord& record) {
    Eigen::Vector3d x;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        x[static_cast<int>(axis)] =
            static_cast<double>(record.position[axis]) + object.description.origin[axis];
    }
    return x;
}

std::vector<Eigen::Vector3d> rounded_to_float(std::vector<Eigen::Vector3d> points) {
    for (Eigen::Vector3d& p : points) p = p.cast<float>().cast<double>().eval();
    return points;
}

using Position = std::array<double, 3>;

std::set<Position> as_set(const std::vector<Eigen::Vector3d>& points) {
    std::set<Position> set;
    for (const Eigen::Vector3d& p : points) set.insert({p[0], p[1], p[2]});
    return set;
}

BroadcastObject object_of(const std::vector<Eigen::Vector3d>& points,
                          const ObjectOptions& options = {"made", 1}) {
    return make_object(model_of(points), ShapePromise{}, balls_in(points, 20, 3), options);
}

std::set<Position> restored_set(const BroadcastObject& object) {
    std::set<Position> set;
    for (const protocol::VertexRecord& record : object.vertices) {
        const Eigen::Vector3d x = restored(object, record);
        set.insert({x[0], x[1], x[2]});
    }
    return set;
}

}  // namespace

TEST_CASE("float32 positions survive bit for bit, wherever the model lies") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u);
    const double offset = GENERATE(0.0, 0.9, 2.9, 3.1, 40.0, 1.0e3, 5.0e6, 1.0e9, -3.1, -7.7e5);
    const double scale = GENERATE(1.0, 1.0e-3, 1.0e4);
    CAPTURE(seed, offset, scale);
    std::vector<Eigen::Vector3d> points = sphere_points(500, seed);
    for (Eigen::Vector3d& p : points) p = scale * (p + Eigen::Vector3d(offset, -0.5 * offset, 0.1));
    points = rounded_to_float(points);
    if (as_set(points).size() < 2) return;  // rounding to float left a single point
    const BroadcastObject object = object_of(points);
    REQUIRE(restored_set(object) == as_set(points));
    for (const double origin : object.description.origin) {
        CHECK(static_cast<double>(static_cast<float>(origin)) == origin);
    }
}

TEST_CASE("an origin is taken only where the box lies more than three half extents away") {
    // Not float32, for which none is needed.
    const double offset = GENERATE(0.0, 2.8, 2.99, 3.01, 100.1, -2.99, -3.01);
    std::vector<Eigen::Vector3d> points;
    for (const double x : {-1.0, 1.0}) {
        for (const double y : {-1.0, 1.0}) {
            points.emplace_back(x + offset, y, 0.0);
            points.emplace_back(x + offset, y, 1.0);
        }
    }
    const BroadcastObject object = object_of(points);
    CHECK((object.description.origin[0] != 0.0) == (std::abs(offset) > 3.0));
    CHECK(object.description.origin[1] == 0.0);
    CHECK(object.description.origin[2] == 0.0);
}

TEST_CASE("the origin carries the precision of double positions far away") {
    const double offset = GENERATE(1.0e3, 3.7e6, 1.234567e9, 4.2e13, 1.0e60);
    const double size = GENERATE(1.0, 1.0e3);
    CAPTURE(offset, size);
    std::vector<Eigen::Vector3d> points = sphere_points(300, 5);
    for (Eigen::Vector3d& p : points) p = size * p + Eigen::Vector3d(offset, offset, -offset);
    const std::set<Position> wanted = as_set(points);
    if (wanted.size() < 2) {  // 1e60: doubles themselves do not resolve the sphere
        CHECK_THROWS_AS(object_of(points), std::invalid_argument);
        return;
    }
    const BroadcastObject object = object_of(points);
    // A record is off by at most half a unit in the last place of 2 extents, plus double's own
    // rounding.
    const double bound = 4.0 * size * 0x1p-24 + 4.0 * offset * 0x1p-53;
    for (const protocol::VertexRecord& record : object.vertices) {
        const Eigen::Vector3d x = restored(object, record);
        double nearest = std::numeric_limits<double>::infinity();
        for (const Eigen::Vector3d& p : points) {
            nearest = std::min(nearest, (p - x).cwiseAbs().maxCoeff());
        }
        REQUIRE(nearest <= bound);
    }
}

TEST_CASE("the hinted box holds every vertex exactly and touches all six sides") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u, 4u);
    std::vector<Eigen::Vector3d> points = sphere_points(777, seed);
    for (Eigen::Vector3d& p : points) p = 0.1 * p + Eigen::Vector3d(1.0e4, -3.3, 0.033);
    const BroadcastObject object = object_of(points);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        float low = std::numeric_limits<float>::infinity();
        float high = -low;
        for (const protocol::VertexRecord& record : object.vertices) {
            low = std::min(low, record.position[axis]);
            high = std::max(high, record.position[axis]);
        }
        CHECK(low == object.hint.box_min[axis]);
        CHECK(high == object.hint.box_max[axis]);
    }
    for (const protocol::VertexRecord& record : object.vertices) {
        REQUIRE(protocol::acceptable(record, object.hint));
    }
    CHECK(object.hint.vertices == object.vertices.size());
    CHECK(object.hint.ellipsoids == object.ellipsoids.size());
}

TEST_CASE("vertices that become equal by rounding are sent once, and -0 is 0") {
    std::vector<Eigen::Vector3d> points = sphere_points(100, 9);
    points.emplace_back(0.25, 0.5, 0.0);
    points.emplace_back(0.25 + 1.0e-12, 0.5, 0.0);
    points.emplace_back(0.25, 0.5, -0.0);
    const BroadcastObject object = object_of(points);
    CHECK(object.vertices.size() == 101);
    CHECK(object.hint.vertices == 101);
}

TEST_CASE("ellipsoids that no receiver would accept are left out, the others keep their order") {
    const std::vector<Eigen::Vector3d> points = sphere_points(100, 9);
    Decomposition decomposition = balls_in(points, 6, 1);
    decomposition.ellipsoids[1].center = Eigen::Vector3d(9.0, 0.0, 0.0);  // far outside the box
    decomposition.ellipsoids[3].L *= 1.0e-9;
    decomposition.ellipsoids[4].L *= 1.0e3;
    const BroadcastObject object =
        make_object(model_of(points), ShapePromise{}, decomposition, {"made", 1});
    REQUIRE(object.ellipsoids.size() == 3);
    const std::array<std::size_t, 3> kept{0, 2, 5};
    for (std::size_t k = 0; k < kept.size(); ++k) {
        const common::Ellipsoid& source = decomposition.ellipsoids[kept[k]];
        CHECK(object.ellipsoids[k].scalars[0] == static_cast<float>(source.center[0]));
        CHECK(object.ellipsoids[k].scalars[3] == static_cast<float>(source.L(0, 0)));
        CHECK(object.ellipsoids[k].scalars[8] == static_cast<float>(source.L(2, 2)));
    }
}

TEST_CASE("an object without vertices or ellipsoids is refused, and so is a size beyond float32") {
    const std::vector<Eigen::Vector3d> points = sphere_points(10, 1);
    CHECK_THROWS_AS(make_object(model_of({}), {}, balls_in(points, 3, 1), {}),
                    std::invalid_argument);
    CHECK_THROWS_AS(make_object(model_of(points), {}, Decomposition{}, {}), std::invalid_argument);
    std::vector<Eigen::Vector3d> huge = points;
    for (Eigen::Vector3d& p : huge) p *= 1.0e39;
    CHECK_THROWS_AS(make_object(model_of(huge), {}, balls_in(points, 3, 1), {}),
                    std::invalid_argument);
    const std::vector<Eigen::Vector3d> one(5, Eigen::Vector3d(1.0, 2.0, 3.0));
    CHECK_THROWS_AS(make_object(model_of(one), {}, balls_in(points, 3, 1), {}),
                    std::invalid_argument);
    ShapePromise impossible;
    impossible.euler_all = 3;
    CHECK_THROWS_AS(make_object(model_of(points), impossible, balls_in(points, 3, 1), {}),
                    std::invalid_argument);
}

TEST_CASE("the id is a function of records, order, hint and seed, and of nothing else") {
    const std::vector<Eigen::Vector3d> points = sphere_points(200, 4);
    const Decomposition balls = balls_in(points, 20, 3);
    const auto id = [](const std::vector<Eigen::Vector3d>& p, const ShapePromise& promise,
                       const Decomposition& d, const ObjectOptions& options) {
        return make_object(model_of(p), promise, d, options).id;
    };
    const protocol::ObjectId base = id(points, {}, balls, {"a", 1});
    CHECK(base == id(points, {}, balls, {"another name", 1}));

    std::set<protocol::ObjectId> ids{base};
    ids.insert(id(points, {}, balls, {"a", 2}));
    std::vector<Eigen::Vector3d> moved = points;
    moved[17][1] = std::nextafter(static_cast<float>(moved[17][1]), 2.0f);
    ids.insert(id(moved, {}, balls, {"a", 1}));
    std::vector<Eigen::Vector3d> fewer = points;
    fewer.pop_back();
    ids.insert(id(fewer, {}, balls, {"a", 1}));
    Decomposition other = balls;
    std::swap(other.ellipsoids[3], other.ellipsoids[4]);
    ids.insert(id(points, {}, other, {"a", 1}));
    other.ellipsoids.pop_back();
    ids.insert(id(points, {}, other, {"a", 1}));
    ids.insert(id(points, {2, 4, 2, false, ""}, balls, {"a", 1}));
    ids.insert(id(points, {2, 2, 2, false, ""}, balls, {"a", 1}));
    ids.insert(id(points, {2, 2, 0, false, ""}, balls, {"a", 1}));
    ids.insert(id(points, {1, 2, 2, true, "parts overlap"}, balls, {"a", 1}));
    CHECK(ids.size() == 10);
}

TEST_CASE("the id is the digest that a receiver makes of the complete object") {
    const BroadcastObject object = tests::made_object(4, 6);
    CHECK(object.id ==
          protocol::object_id_of<common::Digest>(object.hint, object.ellipsoids, object.vertices));
}

TEST_CASE("the spread order is a permutation that the seed decides") {
    const std::size_t count = GENERATE(0u, 1u, 2u, 3u, 5u, 8u, 63u, 64u, 65u, 1000u, 4097u);
    CAPTURE(count);
    const std::vector<Eigen::Vector3d> points = sphere_points(count, 11);
    std::vector<std::uint32_t> order = spread_order(points, 1);
    CHECK(order == spread_order(points, 1));
    if (count > 8) CHECK(order != spread_order(points, 2));
    std::sort(order.begin(), order.end());
    REQUIRE(order.size() == count);
    for (std::size_t k = 0; k < count; ++k) REQUIRE(order[k] == k);
}

TEST_CASE("equal positions and a single plane still give a permutation") {
    std::vector<Eigen::Vector3d> points(50, Eigen::Vector3d(1.0, 2.0, 3.0));
    std::vector<std::uint32_t> order = spread_order(points, 1);
    std::sort(order.begin(), order.end());
    for (std::size_t k = 0; k < points.size(); ++k) REQUIRE(order[k] == k);
}

TEST_CASE("runs of 2^d at an odd stride enter 2^d different parts of the curve") {
    const std::size_t count = GENERATE(64u, 1000u, 1536u, 4096u, 5000u);
    const std::size_t stride = GENERATE(1u, 3u, 5u, 7u, 17u, 101u);
    CAPTURE(count, stride);
    const std::vector<std::uint32_t> order = spread_order(tests::line_points(count), 7);
    // 2^4 consecutive visits, aligned or not, stand in 16 different sixteenths; x is the rank.
    // Sixteenths differ in size by one, hence the slack of one rank at their borders.
    for (std::size_t first = 0; first + 15 * stride < count; ++first) {
        std::vector<std::uint32_t> ranks;
        for (std::size_t k = 0; k < 16; ++k) ranks.push_back(order[first + k * stride]);
        std::sort(ranks.begin(), ranks.end());
        for (std::size_t k = 0; k < 16; ++k) {
            REQUIRE(ranks[k] + 1 >= count * k / 16);
            REQUIRE(ranks[k] <= count * (k + 1) / 16 + 1);
        }
    }
}

TEST_CASE("every prefix of the spread order covers the surface better than a random one") {
    const std::size_t count = 20'000;
    const std::vector<Eigen::Vector3d> points = sphere_points(count, 21);
    const std::vector<std::uint32_t> order = spread_order(points, 1);
    // Squared deviation of the counts in 8 x 16 equal-area cells from even. A random order has the
    // variance of a draw without replacement, length (1 - length / count) in all; x 0.5 is what we
    // ask.
    const auto cell = [](const Eigen::Vector3d& p) {
        const double turn = std::atan2(p[1], p[0]) / (2.0 * std::numbers::pi) + 0.5;
        const auto row = std::min<std::size_t>(7, static_cast<std::size_t>((p[2] + 1.0) * 4.0));
        return row * 16 + std::min<std::size_t>(15, static_cast<std::size_t>(turn * 16.0));
    };
    std::array<double, 128> share{};
    for (const Eigen::Vector3d& p : points) share[cell(p)] += 1.0 / static_cast<double>(count);
    for (const double fraction : {0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75}) {
        const auto length = static_cast<std::size_t>(fraction * static_cast<double>(count));
        std::array<double, 128> counts{};
        for (std::size_t k = 0; k < length; ++k) counts[cell(points[order[k]])] += 1.0;
        double deviation = 0.0;
        for (std::size_t c = 0; c < counts.size(); ++c) {
            const double even = share[c] * static_cast<double>(length);
            deviation += (counts[c] - even) * (counts[c] - even);
        }
        const double of_random = static_cast<double>(length) * (1.0 - fraction);
        CAPTURE(fraction, deviation / of_random);
        CHECK(deviation < 0.6 * of_random);
    }
}

}  // namespace ellicast::sender
