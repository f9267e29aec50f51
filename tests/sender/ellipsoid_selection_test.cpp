// tests/sender/ellipsoid_selection_test.cpp
#include "sender/ellipsoid_selection.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/random.hpp"
#include "sender/ellipsoid_rows.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::GridFrame;
using common::Random;
using Eigen::Vector3d;

GridFrame unit_grid(int cells) {
    GridFrame frame;
    frame.origin = Vector3d::Constant(-0.5);
    frame.spacing = 1.0 / cells;
    frame.dims = {cells + 1, cells - 3, cells + 2};
    return frame;
}

Ellipsoid random_ellipsoid(Random& random, double largest) {
    Ellipsoid e;
    e.center =
        Vector3d(random.uniform(), random.uniform(), random.uniform()) - Vector3d::Constant(0.5);
    e.L.setZero();
    for (int i = 0; i < 3; ++i) {
        e.L(i, i) = largest * (0.05 + 0.95 * random.uniform());
        for (int j = 0; j < i; ++j) e.L(i, j) = largest * (random.uniform() - 0.5);
    }
    return e;
}

std::vector<Ellipsoid> random_ellipsoids(std::size_t count, double largest, Random& random) {
    std::vector<Ellipsoid> all;
    for (std::size_t i = 0; i < count; ++i) {
        all.push_back(random_ellipsoid(random, largest));
        all.back().center *= 0.5;  // most of them where the solid is
    }
    return all;
}

// A thick ball and a thin plate.
std::vector<std::uint8_t> some_solid(const GridFrame& frame) {
    std::vector<std::uint8_t> solid(frame.size(), 0);
    for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
            for (int i = 0; i < frame.dims[0]; ++i) {
                const Vector3d x = frame.position(i, j, k);
                const bool inside = x.norm() < 0.3 || (std::abs(x[2]) < 0.04 && x.norm() < 0.48);
                solid[frame.index(i, j, k)] = inside ? 1 : 0;
            }
        }
    }
    return solid;
}

TEST_CASE("rows hold the nodes inside an ellipsoid, no others and none twice") {
    const GridFrame frame = unit_grid(24);
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        CAPTURE(seed);
        Random random(seed);
        const Ellipsoid e = random_ellipsoid(random, random.chance(0.5) ? 0.4 : 0.05);
        const EllipsoidRows rows(e, frame);
        std::vector<int> times(frame.size(), 0);
        std::size_t last = 0;
        bool ordered = true, boxed = true;
        rows.for_each([&](const VoxelRow& row) {
            REQUIRE(row.begin < row.end);
            REQUIRE(row.begin >= 0);
            REQUIRE(row.end <= frame.dims[0]);
            const std::size_t at = frame.index(row.begin, row.j, row.k) + 1;
            ordered = ordered && at > last;
            last = at;
            const VoxelBox nodes{{row.begin, row.j, row.k}, {row.end, row.j + 1, row.k + 1}};
            for (std::size_t a = 0; a < 3; ++a) {
                boxed = boxed && nodes.begin[a] >= rows.box().begin[a] &&
                        nodes.end[a] <= rows.box().end[a];
            }
            for (int i = row.begin; i < row.end; ++i) ++times[frame.index(i, row.j, row.k)];
        });
        CHECK(ordered);
        CHECK(boxed);
        std::size_t wrong = 0;
        for (int k = 0; k < frame.dims[2]; ++k) {
            for (int j = 0; j < frame.dims[1]; ++j) {
                for (int i = 0; i < frame.dims[0]; ++i) {
                    const Vector3d d = frame.position(i, j, k) - e.center;
                    const double s = e.L.triangularView<Eigen::Lower>().solve(d).norm();
                    if (std::abs(s - 1.0) < 1e-3) continue;  // float32
                    if (times[frame.index(i, j, k)] != (s < 1.0 ? 1 : 0)) ++wrong;
                }
            }
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE("an ellipsoid beyond the grid has no rows, one around it all of them") {
    const GridFrame frame = unit_grid(10);
    Ellipsoid e;
    e.center = Vector3d(5.0, 0.0, 0.0);
    e.L *= 0.3;
    std::size_t nodes = 0;
    const auto count = [&](const VoxelRow& row) {
        nodes += static_cast<std::size_t>(row.end - row.begin);
    };
    EllipsoidRows(e, frame).for_each(count);
    CHECK(nodes == 0);
    e.center.setZero();
    e.L *= 1e6;
    EllipsoidRows(e, frame).for_each(count);
    CHECK(nodes == frame.size());
}

// Plain greedy, written from the definition: every candidate anew in every step, voxel by voxel.
class PlainGreedy {
  public:
    PlainGreedy(const std::vector<Ellipsoid>& candidates, const GridFrame& frame,
                const std::vector<std::uint8_t>& solid, const SelectionOptions& options)
        : options_(options), solid_(solid), nodes_(candidates.size()) {
        std::vector<float> thickness(frame.size(), 0.0f);
        for (std::size_t c = 0; c < candidates.size(); ++c) {
            radii_.push_back(static_cast<float>(common::semi_axes(candidates[c])[0]));
            EllipsoidRows(candidates[c], frame).for_each([&](const VoxelRow& row) {
                for (int i = row.begin; i < row.end; ++i) {
                    nodes_[c].push_back(frame.index(i, row.j, row.k));
                    float& t = thickness[nodes_[c].back()];
                    t = std::max(t, radii_[c]);
                }
            });
        }
        for (std::size_t v = 0; v < frame.size(); ++v) weights_.push_back(weight(v, thickness[v]));
    }

    std::vector<std::uint32_t> select() {
        std::vector<std::uint32_t> order;
        while (order.size() < options_.count) {
            const std::optional<std::uint32_t> best = best_candidate(order);
            if (!best) break;
            order.push_back(*best);
            for (const std::size_t v : nodes_[*best]) {
                if (solid_[v] == 0) continue;
                const auto p = static_cast<std::int64_t>(std::lround(options_.loss * 65536.0));
                weights_[v] = weights_[v] * p / 65536;
            }
        }
        return order;
    }

  private:
    [[nodiscard]] std::int64_t weight(std::size_t v, float thickness) const {
        if (solid_[v] == 0) return -std::lround(65536.0 * options_.outside);
        const auto floor = static_cast<float>(options_.thinness_floor * options_.diagonal);
        const auto reference = static_cast<float>(options_.thinness_reference * options_.diagonal);
        const float w = options_.thinness ? reference / std::max(floor, thickness) : 1.0f;
        return static_cast<std::int64_t>(w * static_cast<float>(65536.0 * (1.0 - options_.loss)));
    }

    [[nodiscard]] std::optional<std::uint32_t> best_candidate(
        const std::vector<std::uint32_t>& taken) const {
        std::vector<std::int64_t> gains(nodes_.size(), 0);
        for (std::uint32_t c = 0; c < nodes_.size(); ++c) {
            if (std::find(taken.begin(), taken.end(), c) != taken.end()) continue;
            for (const std::size_t v : nodes_[c]) gains[c] += weights_[v];
        }
        const std::int64_t most = *std::max_element(gains.begin(), gains.end());
        if (most <= 0) return std::nullopt;
        const auto least = std::max<std::int64_t>(
            1, std::llround((1.0 - options_.tie) * static_cast<double>(most)));
        std::optional<std::uint32_t> best;
        for (std::uint32_t c = 0; c < gains.size(); ++c) {
            if (gains[c] >= least && (!best || radii_[c] < radii_[*best])) best = c;
        }
        return best;
    }

    SelectionOptions options_;
    const std::vector<std::uint8_t>& solid_;
    std::vector<std::vector<std::size_t>> nodes_;
    std::vector<float> radii_;
    std::vector<std::int64_t> weights_;
};

SelectionOptions robust_options() {
    SelectionOptions options;
    options.loss = 0.3;
    options.thinness = true;
    options.outside = 0.5;
    options.count = 60;
    return options;
}

TEST_CASE("lazy selection is plain greedy selection, under both criteria") {
    const GridFrame frame = unit_grid(28);
    const std::vector<std::uint8_t> solid = some_solid(frame);
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        for (const bool robust : {false, true}) {
            for (const double tie : {0.0, 0.01, 0.2}) {
                CAPTURE(seed, robust, tie);
                Random random(seed);
                SelectionOptions options = robust ? robust_options() : SelectionOptions{};
                options.count = 60;
                options.tie = tie;
                const std::vector<Ellipsoid> candidates = random_ellipsoids(150, 0.12, random);
                const Selection selection = select_greedily(candidates, frame, solid, options);
                CHECK(selection.order == PlainGreedy(candidates, frame, solid, options).select());
            }
        }
    }
}

TEST_CASE("any prefix of a selection is the selection of that size") {
    const GridFrame frame = unit_grid(28);
    const std::vector<std::uint8_t> solid = some_solid(frame);
    Random random(3);
    const std::vector<Ellipsoid> candidates = random_ellipsoids(200, 0.1, random);
    SelectionOptions options = robust_options();
    const std::vector<std::uint32_t> all = select_greedily(candidates, frame, solid, options).order;
    REQUIRE(all.size() > 40);
    for (const std::size_t count : {1u, 7u, 33u}) {
        options.count = count;
        const std::vector<std::uint32_t> some =
            select_greedily(candidates, frame, solid, options).order;
        CHECK(std::equal(some.begin(), some.end(), all.begin()));
        CHECK(some.size() == count);
    }
}

TEST_CASE("threads change nothing in a selection") {
    const GridFrame frame = unit_grid(28);
    const std::vector<std::uint8_t> solid = some_solid(frame);
    Random random(5);
    const std::vector<Ellipsoid> candidates = random_ellipsoids(300, 0.1, random);
    SelectionOptions options = robust_options();
    options.threads = 1;
    const Selection one = select_greedily(candidates, frame, solid, options);
    for (const unsigned threads : {2u, 3u, 16u}) {
        options.threads = threads;
        const Selection many = select_greedily(candidates, frame, solid, options);
        CHECK(many.order == one.order);
        CHECK(many.covered == one.covered);
        CHECK(many.outside == one.outside);
    }
}

TEST_CASE("without loss the first is the largest and nothing is covered twice for gain") {
    const GridFrame frame = unit_grid(40);
    const std::vector<std::uint8_t> solid(frame.size(), 1);
    std::vector<Ellipsoid> candidates(4);
    for (Ellipsoid& e : candidates) e.L *= 0.1;
    candidates[1].L *= 2.0;
    candidates[2].L *= 1.5;                        // inside the largest: no gain
    candidates[3].center = Vector3d(0.3, 0.3, 0);  // beside it
    const Selection selection = select_greedily(candidates, frame, solid, {});
    CHECK(selection.order == std::vector<std::uint32_t>{1, 3});
    CHECK(selection.covered < selection.solid);
    CHECK(selection.outside == 0);
}

TEST_CASE("under loss a second cover is worth p times the first") {
    const GridFrame frame = unit_grid(40);
    const std::vector<std::uint8_t> solid(frame.size(), 1);
    // Two copies of a large ball and a small one of a little less than 0.3 of its volume.
    std::vector<Ellipsoid> candidates(3);
    candidates[0].L *= 0.2;
    candidates[1].L *= 0.2;
    candidates[2].L *= 0.2 * std::cbrt(0.28);
    candidates[2].center = Vector3d(0.35, 0.0, 0.0);
    SelectionOptions options;
    options.loss = 0.3;
    CHECK(select_greedily(candidates, frame, solid, options).order ==
          std::vector<std::uint32_t>{0, 1, 2});
    options.loss = 0.2;
    CHECK(select_greedily(candidates, frame, solid, options).order ==
          std::vector<std::uint32_t>{0, 2, 1});
}

TEST_CASE("thin places come before thick ones of the same volume") {
    const GridFrame frame = unit_grid(60);
    const std::vector<std::uint8_t> solid(frame.size(), 1);
    std::vector<Ellipsoid> candidates(2);
    candidates[0].center = Vector3d(-0.25, -0.2, 0.0);
    candidates[0].L *= 0.15;
    candidates[1].center = Vector3d(0.1, 0.1, 0.0);
    candidates[1].L.diagonal() = Vector3d(0.3, 0.05, 0.2);  // a little less volume
    SelectionOptions options;
    CHECK(select_greedily(candidates, frame, solid, options).order.front() == 0);
    options.thinness = true;
    CHECK(select_greedily(candidates, frame, solid, options).order.front() == 1);
}

TEST_CASE("among equal gains the smallest minimum radius wins, then the smaller index") {
    const GridFrame frame = unit_grid(60);
    const std::vector<std::uint8_t> solid(frame.size(), 1);
    std::vector<Ellipsoid> candidates(3);
    candidates[0].L *= 0.1;
    candidates[1].L.diagonal() = Vector3d(0.05, 0.2, 0.1);  // the same volume
    candidates[2].L = candidates[1].L;
    candidates[1].center = Vector3d(0.2, 0.2, 0.2);
    candidates[2].center = Vector3d(-0.2, -0.2, -0.2);
    SelectionOptions options;
    options.tie = 0.05;
    CHECK(select_greedily(candidates, frame, solid, options).order ==
          std::vector<std::uint32_t>{1, 2, 0});
}

TEST_CASE("ellipsoids that mostly poke out are not taken when that has a price") {
    const GridFrame frame = unit_grid(40);
    const std::vector<std::uint8_t> solid = some_solid(frame);
    Ellipsoid outside;
    outside.center = Vector3d(0.0, 0.0, 0.35);
    outside.L *= 0.14;
    SelectionOptions options;
    CHECK(select_greedily(std::vector<Ellipsoid>{outside}, frame, solid, options).order.size() ==
          1);
    options.outside = 0.5;
    CHECK(select_greedily(std::vector<Ellipsoid>{outside}, frame, solid, options).order.empty());
}

TEST_CASE("nothing to choose from, or nothing to cover, selects nothing") {
    const GridFrame frame = unit_grid(20);
    CHECK(select_greedily({}, frame, some_solid(frame), {}).order.empty());
    const std::vector<std::uint8_t> empty(frame.size(), 0);
    Ellipsoid e;
    e.L *= 0.2;
    CHECK(select_greedily(std::vector<Ellipsoid>{e}, frame, empty, {}).order.empty());
}

}  // namespace
}  // namespace ellicast::sender
