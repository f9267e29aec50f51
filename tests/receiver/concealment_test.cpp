// tests/receiver/concealment_test.cpp
#include "receiver/concealment.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "common/self_intersection.hpp"
#include "common/vertex_normals.hpp"
#include "receiver/surface_mesh.hpp"
#include "receiver/vertex_removal.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using common::TriangleMesh;
using Eigen::Vector3d;

namespace {

constexpr double kNoTrust = 1e6;   // doubt with which the guide counts for nothing
constexpr double kOneLevel = 1e6;  // cell with which no edge is long
constexpr Gaps kFull{0.0, 1.0};    // all that an edge asks for

std::vector<KnownVertex> estimated(const TriangleMesh& mesh, double doubt) {
    std::vector<KnownVertex> known;
    for (const Vector3d& normal : common::vertex_normals(mesh)) known.push_back({normal, doubt});
    return known;
}

// With the mesh itself as the guide.
TriangleMesh concealed(const TriangleMesh& mesh, double doubt, double cell,
                       const Gaps& gaps = kFull, unsigned threads = 1) {
    const common::TriangleTree guide(mesh);
    return conceal(mesh, estimated(mesh, doubt), {&guide, cell}, gaps, threads).mesh;
}

TriangleMesh thinned(const TriangleMesh& mesh, double kept, std::uint64_t seed) {
    common::Random random(seed);
    std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    REQUIRE(surface);
    std::vector<bool> wanted(mesh.positions.size());
    for (std::size_t v = 0; v < wanted.size(); ++v) wanted[v] = random.chance(kept);
    remove_vertices(*surface, [&](VertexId v) { return !wanted[v]; });
    return surface->extract();
}

void require_same_topology(const TriangleMesh& before, const TriangleMesh& after) {
    const common::MeshTopology a = common::analyse_topology(before);
    const common::MeshTopology b = common::analyse_topology(after);
    REQUIRE(a.manifold);
    REQUIRE(b.closed);
    REQUIRE(b.manifold);
    REQUIRE(b.components == a.components);
    REQUIRE(b.euler == a.euler);
    REQUIRE(b.vertices == after.positions.size());  // all in use
}

void require_positions_kept(const TriangleMesh& before, const TriangleMesh& after) {
    REQUIRE(after.positions.size() >= before.positions.size());
    REQUIRE(std::equal(before.positions.begin(), before.positions.end(), after.positions.begin()));
}

std::size_t edges_of(const TriangleMesh& mesh) {
    return 3 * mesh.triangles.size() / 2;
}

// How far a point is outside a cube around the origin (> 0), or inside (< 0).
double height_above_cube(const Vector3d& p, double side) {
    return p.cwiseAbs().maxCoeff() - 0.5 * side;
}

}  // namespace

TEST_CASE("concealment keeps positions in their places, and the topology") {
    const std::uint64_t seed = GENERATE(1U, 2U, 3U);
    const double kept = GENERATE(0.7, 0.3, 0.1);
    const TriangleMesh shapes[] = {tests::icosphere(3), tests::torus(1, 0.4, 40, 20),
                                   tests::double_torus(24), tests::box({1, 2, 0.5}, 6),
                                   tests::two_parts()};
    for (const TriangleMesh& shape : shapes) {
        const TriangleMesh mesh = thinned(shape, kept, seed);
        CAPTURE(seed, kept, mesh.positions.size());
        for (const double cell : {kOneLevel, 0.05}) {
            for (const double doubt : {0.0, 0.02, kNoTrust}) {
                const TriangleMesh result = concealed(mesh, doubt, cell);
                require_positions_kept(mesh, result);
                require_same_topology(mesh, result);
                for (const Vector3d& p : result.positions) REQUIRE(p.allFinite());
            }
        }
    }
}

TEST_CASE("on a sphere, normals alone bring most midpoints nearer to it than the chord") {
    const TriangleMesh mesh = thinned(tests::icosphere(3), 0.6, 5);
    const TriangleMesh flat = concealed(mesh, kNoTrust, kOneLevel, {0.0, 1e-9});
    const TriangleMesh curved = concealed(mesh, kNoTrust, kOneLevel);
    REQUIRE(flat.positions.size() == curved.positions.size());
    REQUIRE(curved.positions.size() == mesh.positions.size() + edges_of(mesh));
    double before = 0.0;
    double after = 0.0;
    std::size_t worse = 0;
    for (std::size_t v = mesh.positions.size(); v < curved.positions.size(); ++v) {
        const double chord = std::abs(1.0 - flat.positions[v].norm());
        const double error = std::abs(1.0 - curved.positions[v].norm());
        if (!(error < chord)) ++worse;
        before += chord * chord;
        after += error * error;
    }
    // Weights are those of scans, not of spheres: some edges get worse, where the other
    // diagonal is much the longer.
    CHECK(worse < edges_of(mesh) / 7);
    CHECK(after < 0.25 * before);
}

TEST_CASE("a guide that was right at the ends is followed between them") {
    const TriangleMesh mesh = tests::icosphere(1);
    const common::TriangleTree sphere(tests::icosphere(5));
    std::vector<KnownVertex> known = estimated(mesh, 0.0);
    for (KnownVertex& vertex : known) vertex.normal.setZero();  // normals ask for nothing
    const TriangleMesh result = conceal(mesh, known, {&sphere, kOneLevel}, kFull, 1).mesh;
    REQUIRE(result.positions.size() == mesh.positions.size() + edges_of(mesh));
    for (std::size_t v = mesh.positions.size(); v < result.positions.size(); ++v) {
        REQUIRE(result.positions[v].norm() == Approx(1.0).margin(0.01));  // the chords': 0.96
    }
    // One that was wrong there is not: then only the other diagonal speaks, and softly.
    for (KnownVertex& vertex : known) vertex.doubt = kNoTrust;
    const TriangleMesh doubtful = conceal(mesh, known, {&sphere, kOneLevel}, kFull, 1).mesh;
    for (std::size_t v = mesh.positions.size(); v < doubtful.positions.size(); ++v) {
        REQUIRE(doubtful.positions[v].norm() < 0.97);
    }
}

TEST_CASE("a cube stays a cube: creases are not rounded, and flat edges are not split") {
    const int n = GENERATE(1, 2, 4);
    const TriangleMesh mesh = tests::box({1, 1, 1}, n);
    const double edge = 1.0 / n;
    const TriangleMesh result = concealed(mesh, 0.0, kOneLevel);
    CAPTURE(n);
    require_same_topology(mesh, result);
    for (std::size_t v = mesh.positions.size(); v < result.positions.size(); ++v) {
        const Vector3d& p = result.positions[v];
        CAPTURE(p.transpose());
        // Only edges of the cube are split; the other diagonal pulls them in by a twentieth.
        Vector3d away = (p.cwiseAbs().array() - 0.5).abs();
        std::sort(away.data(), away.data() + 3);
        REQUIRE(away[1] < 0.051 * edge);
        REQUIRE(height_above_cube(p, 1.0) < 1e-9);
    }
    CHECK(result.positions.size() <= mesh.positions.size() + static_cast<std::size_t>(12 * n));
}

TEST_CASE("without a guide, creases stay within bounds, and faces beyond them flat") {
    const int n = GENERATE(1, 2, 4, 8);
    const TriangleMesh mesh = tests::box({1, 1, 1}, n);
    const double edge = 1.0 / n;
    const TriangleMesh result = concealed(mesh, kNoTrust, kOneLevel);
    CAPTURE(n);
    require_same_topology(mesh, result);
    for (std::size_t v = mesh.positions.size(); v < result.positions.size(); ++v) {
        const Vector3d& p = result.positions[v];
        CAPTURE(p.transpose());
        // Normals that were averaged across a corner make the diagonal before it bulge.
        REQUIRE(std::abs(height_above_cube(p, 1.0)) < 0.12 * edge);
        Vector3d sorted = p.cwiseAbs();
        std::sort(sorted.data(), sorted.data() + 3);
        if (sorted[1] < 0.5 - 1.01 * edge) FAIL("an edge within a face was split");
    }
}

TEST_CASE("triangles are cut to fit whatever sides are split") {
    // Normals that tilt at one vertex alone make edges around it bulge, and no others.
    TriangleMesh mesh = tests::box({1, 1, 1}, 4);
    std::vector<KnownVertex> known = estimated(mesh, kNoTrust);
    const common::TriangleTree guide(mesh);
    common::Random random(3);
    for (int round = 0; round < 20; ++round) {
        std::vector<KnownVertex> tilted = known;
        for (std::size_t v = 0; v < tilted.size(); ++v) {
            if (random.chance(0.5)) {
                tilted[v].normal = (tilted[v].normal + 0.4 * mesh.positions[v]).normalized();
            }
        }
        const TriangleMesh result = conceal(mesh, tilted, {&guide, kOneLevel}, kFull, 1).mesh;
        CHECK(result.positions.size() > mesh.positions.size() + 20);
        CHECK(result.positions.size() < mesh.positions.size() + edges_of(mesh) - 20);
        require_positions_kept(mesh, result);
        require_same_topology(mesh, result);
        // Every triangle that was cut has what it was made of: areas stay near.
        for (const common::Triangle& t : result.triangles) {
            REQUIRE(t[0] != t[1]);
            REQUIRE(t[1] != t[2]);
            REQUIRE(t[2] != t[0]);
        }
    }
}

TEST_CASE("where nothing is missing nothing changes") {
    const TriangleMesh mesh = thinned(tests::torus(1, 0.4, 30, 15), 0.5, 2);
    const TriangleMesh result = concealed(mesh, 0.0, 0.01, Gaps{});
    CHECK(result.positions == mesh.positions);
    CHECK(result.triangles == mesh.triangles);
}

TEST_CASE("the less is missing, the less is added") {
    const TriangleMesh mesh = tests::icosphere(2);
    double before = 0.0;
    for (const double missing : {0.01, 0.1, 0.3, 0.6, 1.0}) {
        const TriangleMesh result = concealed(mesh, kNoTrust, kOneLevel, {missing, 0.0});
        double height = 0.0;
        for (std::size_t v = mesh.positions.size(); v < result.positions.size(); ++v) {
            height += result.positions[v].norm();
        }
        height /= static_cast<double>(edges_of(mesh));
        CAPTURE(missing, height);
        CHECK(height > before);
        before = height;
    }
}

TEST_CASE("where little is missing, edges across a gap bulge and the others hardly") {
    // A sphere that lacks one vertex of each patch.
    TriangleMesh mesh = tests::icosphere(3);
    std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    REQUIRE(surface);
    const std::size_t lost = tests::icosphere(0).positions.size();
    remove_vertices(*surface, [&](VertexId v) { return v < lost; });
    mesh = surface->extract();
    const common::TriangleTree guide(mesh);
    const auto share_of_bulge = [&](const Gaps& gaps) {
        const Concealed all =
            conceal(mesh, estimated(mesh, kNoTrust), {&guide, kOneLevel}, kFull, 1);
        const Concealed result =
            conceal(mesh, estimated(mesh, kNoTrust), {&guide, kOneLevel}, gaps, 1);
        REQUIRE(result.parents == all.parents);
        std::array<double, 2> sums{};   // of the edges of usual length, and of the longer ones
        std::array<double, 2> whole{};  // with all that there is to bulge
        for (std::size_t k = 0; k < all.parents.size(); ++k) {
            const Vector3d& a = mesh.positions[all.parents[k][0]];
            const Vector3d& b = mesh.positions[all.parents[k][1]];
            const std::size_t across = (a - b).norm() > 0.19 ? 1 : 0;  // usual are 0.14 to 0.16
            const std::size_t v = mesh.positions.size() + k;
            sums[across] += (result.mesh.positions[v] - 0.5 * (a + b)).norm();
            whole[across] += (all.mesh.positions[v] - 0.5 * (a + b)).norm();
        }
        REQUIRE(whole[1] > 0.0);
        return std::array{sums[0] / whole[0], sums[1] / whole[1]};
    };
    const auto [usual, across] = share_of_bulge({0.1, 0.0});
    CAPTURE(usual, across);
    CHECK(usual < 0.25);
    CHECK(across > 0.4);
    CHECK(across > 2.0 * usual);
    CHECK(share_of_bulge({0.5, 0.0})[0] > 0.8);
    const auto [least, more] = share_of_bulge({0.1, 0.5});
    CHECK(least == Approx(0.5));
    CHECK(more >= across);
}

TEST_CASE("only edges longer than two cells are split again, at most twice") {
    const TriangleMesh mesh = tests::icosphere(1);  // edges of 0.55 and 0.62
    const common::TriangleTree sphere(tests::icosphere(5));
    const auto size = [&](double cell) {
        return conceal(mesh, estimated(mesh, 0.0), {&sphere, cell}, kFull, 1).mesh.positions.size();
    };
    CHECK(size(1.0) == 162);     // icosphere(2)
    CHECK(size(0.12) == 642);    // halves of 0.28 and 0.31
    CHECK(size(0.001) == 2562);  // three levels and no more
}

TEST_CASE("guessed vertices know the edge that they split") {
    const TriangleMesh mesh = tests::icosphere(1);
    const common::TriangleTree guide(mesh);
    const Concealed result =
        conceal(mesh, estimated(mesh, kNoTrust), {&guide, 0.1}, {0.0, 1e-9}, 1);
    const auto& positions = result.mesh.positions;
    REQUIRE(positions.size() == mesh.positions.size() + result.parents.size());
    for (std::size_t k = 0; k < result.parents.size(); ++k) {
        const std::size_t v = mesh.positions.size() + k;
        const auto [a, b] = result.parents[k];
        REQUIRE(a < v);
        REQUIRE(b < v);
        REQUIRE((positions[v] - 0.5 * (positions[a] + positions[b])).norm() < 1e-8);
    }
}

TEST_CASE("guesses that make two near sheets intersect are taken back, and no others") {
    // A plate whose normals ask both sides to bend inwards, further than it is thick.
    const TriangleMesh mesh = tests::box({1, 1, 0.02}, 1);
    std::vector<KnownVertex> known = estimated(mesh, kNoTrust);
    for (std::size_t v = 0; v < known.size(); ++v) {
        Vector3d& normal = known[v].normal;
        const Vector3d& p = mesh.positions[v];
        normal = Vector3d(-0.8 * p.x(), -0.8 * p.y(), p.z() > 0 ? 1 : -1).normalized();
    }
    const common::TriangleTree guide(mesh);
    Concealed result = conceal(mesh, known, {&guide, kOneLevel}, kFull, 1);
    const TriangleMesh before = result.mesh;
    REQUIRE(common::count_self_intersections(before, 1).faces > 0);
    Concealed other = result;
    CHECK(flatten_intersections(result, 1) == 0);
    CHECK(common::count_self_intersections(result.mesh, 1).faces == 0);
    CHECK(result.mesh.triangles == before.triangles);
    require_positions_kept(mesh, result.mesh);
    flatten_intersections(other, 5);
    CHECK(other.mesh.positions == result.mesh.positions);
    // Nothing to do: nothing changes.
    const std::vector<Vector3d> settled = result.mesh.positions;
    CHECK(flatten_intersections(result, 1) == 0);
    CHECK(result.mesh.positions == settled);
}

TEST_CASE("zero-area faces and coincident points give no number that is none") {
    TriangleMesh mesh = tests::icosphere(3);
    common::Random random(6);
    // Edges without length, faces without area, needles, folds.
    for (const common::Triangle& t : mesh.triangles) {
        if (random.chance(0.1)) mesh.positions[t[0]] = mesh.positions[t[1]];
        if (random.chance(0.1)) {
            mesh.positions[t[2]] = 0.5 * (mesh.positions[t[0]] + mesh.positions[t[1]]);
        }
        if (random.chance(0.02)) mesh.positions[t[0]] *= -1.0;
    }
    const double doubt = GENERATE(0.0, 0.1);
    const double cell = GENERATE(kOneLevel, 0.02);
    const TriangleMesh result = concealed(mesh, doubt, cell);
    for (const Vector3d& p : result.positions) REQUIRE(p.allFinite());
    require_positions_kept(mesh, result);
    require_same_topology(mesh, result);
    for (const Vector3d& p : result.positions) REQUIRE(p.norm() < 1.5);
}

TEST_CASE("all points in one place stay as they are") {
    TriangleMesh mesh = tests::icosphere(1);
    for (Vector3d& p : mesh.positions) p = Vector3d(0.1, -0.2, 0.3);
    const TriangleMesh result = concealed(mesh, 0.0, 0.01);
    CHECK(result.positions == mesh.positions);
    CHECK(result.triangles == mesh.triangles);
}

TEST_CASE("threads change no bit of what is guessed") {
    const TriangleMesh mesh = thinned(tests::torus(1, 0.4, 50, 25), 0.4, 9);
    const TriangleMesh one = concealed(mesh, 0.01, 0.03, {0.3, 0.0});
    const TriangleMesh many = concealed(mesh, 0.01, 0.03, {0.3, 0.0}, 7);
    CHECK(one.positions == many.positions);
    CHECK(one.triangles == many.triangles);
}
