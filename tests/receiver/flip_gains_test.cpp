// tests/receiver/flip_gains_test.cpp
#include "receiver/flip_gains.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "common/diagonal_choice.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

SurfaceMesh torus() {
    std::optional<SurfaceMesh> mesh = SurfaceMesh::from(tests::torus(1.0, 0.4, 40, 24));
    REQUIRE(mesh);
    return std::move(*mesh);
}

// Unit vectors, none of which has to do with the surface.
std::vector<Vector3d> random_normals(std::size_t count, std::uint64_t seed) {
    common::Random random(seed);
    std::vector<Vector3d> normals;
    for (std::size_t v = 0; v < count; ++v) {
        normals.push_back(
            Vector3d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.4)
                .normalized());
    }
    return normals;
}

// The gain by its definition, from positions alone.
double gain_by_definition(const SurfaceMesh& mesh, HalfedgeId h, const FlipCriterion& criterion,
                          double unit) {
    const HalfedgeId t = mesh.twin(h);
    const std::array<VertexId, 4> id = {mesh.from_vertex(h), mesh.to_vertex(h), mesh.opposite(h),
                                        mesh.opposite(t)};
    common::Quad quad{mesh.position(id[0]),
                      mesh.position(id[1]),
                      mesh.position(id[2]),
                      mesh.position(id[3]),
                      {},
                      {}};
    const std::array<HalfedgeId, 4> sides = {SurfaceMesh::next(h), SurfaceMesh::prev(h),
                                             SurfaceMesh::next(t), SurfaceMesh::prev(t)};
    for (std::size_t k = 0; k < 4; ++k) {
        quad.outer_normals[k] = mesh.area_normal(SurfaceMesh::face_of(mesh.twin(sides[k])));
        quad.vertex_normals[k] = criterion.normals[id[k]];
    }
    return common::diagonal_gain(quad).weighed(criterion.weights.angle, criterion.weights.rise,
                                               unit);
}

void require_gains_by_definition(const SurfaceMesh& mesh, const FlipGains& gains,
                                 const FlipCriterion& criterion) {
    std::size_t compared = 0;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        const double gain = gains.consider(h).gain;
        if (gain == -std::numeric_limits<double>::infinity()) continue;
        const double expected = gain_by_definition(mesh, h, criterion, gains.unit());
        REQUIRE(gain == Approx(expected).margin(1e-4 * gains.unit()));
        ++compared;
    }
    REQUIRE(compared > mesh.face_slots());
}

TEST_CASE("gains of flips are those of their definition, also after flips and flips undone") {
    SurfaceMesh mesh = torus();
    const std::vector<Vector3d> normals = random_normals(mesh.vertex_slots(), 5);
    const FlipCriterion criterion{.normals = normals, .weights = {.angle = 0.7, .rise = 3.0}};
    FlipGains gains(mesh, criterion);
    require_gains_by_definition(mesh, gains, criterion);
    common::Random random(1);
    std::size_t kept = 0;
    for (int n = 0; n < 2'000; ++n) {
        const auto h = static_cast<HalfedgeId>(random.below(3 * mesh.face_slots()));
        const FlipGains::Trial trial = gains.consider(h);
        if (trial.gain < -gains.unit() || !mesh.can_flip(h)) continue;
        gains.flip(h, trial);
        if (random.chance(0.5)) {
            gains.undo(h, trial);
        } else {
            ++kept;
        }
    }
    REQUIRE(kept > 50);
    REQUIRE(mesh.validate().empty());
    require_gains_by_definition(mesh, gains, criterion);
}

TEST_CASE("what a pair of flips gains is known without flipping") {
    SurfaceMesh mesh = torus();
    const std::vector<Vector3d> normals = random_normals(mesh.vertex_slots(), 6);
    const FlipCriterion criterion{.normals = normals, .weights = {.angle = 0.7, .rise = 3.0}};
    FlipGains gains(mesh, criterion);
    std::size_t compared = 0;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        const FlipGains::Trial first = gains.consider(h);
        if (!(first.gain > -4.0 * gains.unit()) || !mesh.can_flip(h)) continue;
        const double expected = gains.best_pair_gain(h, first);
        gains.flip(h, first);
        const HalfedgeId t = mesh.twin(h);
        double second = -std::numeric_limits<double>::infinity();
        for (const HalfedgeId side : {SurfaceMesh::next(h), SurfaceMesh::prev(h),
                                      SurfaceMesh::next(t), SurfaceMesh::prev(t)}) {
            second = std::max(second, gains.consider(side).gain);
        }
        REQUIRE(first.gain + second == expected);
        gains.undo(h, first);
        ++compared;
    }
    REQUIRE(compared > mesh.face_slots());
}

TEST_CASE("an edge of a settled vertex's ring gains nothing by a flip") {
    SurfaceMesh mesh = torus();
    std::vector<char> settled(mesh.vertex_slots(), 0);
    settled[17] = 1;
    const FlipCriterion criterion{.settled = settled};
    const FlipGains gains(mesh, criterion);
    std::size_t barred = 0;
    for (HalfedgeId h = 0; h < 3 * mesh.face_slots(); ++h) {
        const bool touches = mesh.from_vertex(h) == 17 || mesh.to_vertex(h) == 17 ||
                             mesh.opposite(h) == 17 || mesh.opposite(mesh.twin(h)) == 17;
        const bool refused = gains.consider(h).gain == -std::numeric_limits<double>::infinity();
        REQUIRE(refused == touches);
        barred += refused;
    }
    REQUIRE(barred == 4 * mesh.valence(17));
}

TEST_CASE("a flip that would leave a needle gains nothing") {
    // A long thin rhombus whose short diagonal is there: the long one would make two needles.
    std::optional<SurfaceMesh> mesh =
        SurfaceMesh::from({{{0, -0.01, 0}, {0, 0.01, 0}, {-2, 0, 0}, {2, 0, 0}, {0, 0, -1}},
                           {{0, 1, 2}, {1, 0, 3}, {2, 1, 4}, {0, 2, 4}, {3, 0, 4}, {1, 3, 4}}});
    REQUIRE(mesh);
    const FlipCriterion criterion;
    const FlipGains gains(*mesh, criterion);
    for (HalfedgeId h = 0; h < 3 * mesh->face_slots(); ++h) {
        if (mesh->from_vertex(h) > 1 || mesh->to_vertex(h) > 1) continue;
        REQUIRE(gains.consider(h).gain == -std::numeric_limits<double>::infinity());
    }
}

}  // namespace
}  // namespace ellicast::receiver
