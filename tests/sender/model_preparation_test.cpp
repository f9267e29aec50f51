// tests/sender/model_preparation_test.cpp
#include "sender/model_preparation.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

using common::MeshTopology;
using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

using Place = std::tuple<double, double, double>;
Place place(const Vector3d& p) {
    return {p.x(), p.y(), p.z()};
}

bool same_bits(const Vector3d& a, const Vector3d& b) {
    return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

// What must hold of every prepared model, whatever went in.
void check_sound(const TriangleMesh& input, const PreparedModel& model) {
    const MeshTopology topology = common::analyse_topology(model.solid);
    CHECK(topology.closed);
    CHECK(topology.manifold);
    CHECK(topology.vertices == model.solid.positions.size());  // all are used
    CHECK(common::signed_volume(model.solid) > 0);
    REQUIRE(model.vertices.size() <= model.solid.positions.size());
    CHECK(std::equal(model.vertices.begin(), model.vertices.end(), model.solid.positions.begin(),
                     same_bits));

    // A subsequence of the input's positions, none twice, and all of triangles with three corners.
    std::set<Place> seen;
    std::size_t at = 0;
    for (const Vector3d& p : model.vertices) {
        while (at < input.positions.size() && !same_bits(input.positions[at], p)) ++at;
        CHECK(at++ < input.positions.size());
        CHECK(seen.insert(place(p)).second);
    }
    const Eigen::AlignedBox3d box = common::bounding_box(model.vertices);
    CHECK(box.contains(common::bounding_box(model.solid.positions)));

    const PreparedModel again = prepare_model(input);
    CHECK(again.solid.triangles == model.solid.triangles);
    CHECK(again.warnings == model.warnings);
    CHECK(std::equal(again.solid.positions.begin(), again.solid.positions.end(),
                     model.solid.positions.begin(), model.solid.positions.end(), same_bits));
}

// The distinct positions that triangles use, in file order.
std::vector<Vector3d> used_positions(const TriangleMesh& mesh) {
    std::vector<bool> used(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) used[v] = true;
    }
    std::set<Place> seen;
    std::vector<Vector3d> result;
    for (std::size_t v = 0; v < used.size(); ++v) {
        if (used[v] && seen.insert(place(mesh.positions[v])).second) {
            result.push_back(mesh.positions[v]);
        }
    }
    return result;
}

PreparedModel prepare(const TriangleMesh& input) {
    const PreparedModel model = prepare_model(input);
    check_sound(input, model);
    return model;
}

void check_all_vertices_kept(const TriangleMesh& input, const PreparedModel& model) {
    const std::vector<Vector3d> expected = used_positions(input);
    CHECK(std::equal(model.vertices.begin(), model.vertices.end(), expected.begin(), expected.end(),
                     same_bits));
}

using Lines = std::vector<std::string>;

TriangleMesh inside_out(TriangleMesh mesh) {
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

TriangleMesh without(TriangleMesh mesh, const std::function<bool(const Vector3d&)>& gone) {
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return gone((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0);
    });
    return mesh;
}

TEST_CASE("a closed oriented manifold comes back as it was, without a word") {
    for (const TriangleMesh& mesh : {tests::cube(), tests::icosphere(3), tests::box({1, 2, 3}, 3),
                                     tests::torus(1, 0.3, 24, 16), tests::double_torus(2)}) {
        const PreparedModel model = prepare(mesh);
        CHECK(model.warnings.empty());
        CHECK(model.solid.triangles == mesh.triangles);
        CHECK(model.solid.positions == mesh.positions);
        CHECK(model.vertices == mesh.positions);
    }
}

TEST_CASE("a hole is capped by a fan about its centroid") {
    const TriangleMesh open = tests::open_hemisphere(4);
    const PreparedModel model = prepare(open);
    CHECK(model.warnings == Lines{"filled 1 hole"});
    check_all_vertices_kept(open, model);
    REQUIRE(model.solid.positions.size() == open.positions.size() + 1);
    CHECK(model.solid.positions.back().norm() < 1e-12);
    CHECK(model.solid.triangles.size() == open.triangles.size() + 64);
    CHECK(common::signed_volume(model.solid) == Approx(2.0 / 3.0 * std::numbers::pi).epsilon(0.01));
}

TEST_CASE("a hole of three edges takes one triangle, of any number it is closed") {
    for (const std::size_t gone : {std::size_t{1}, std::size_t{2}, std::size_t{5}}) {
        TriangleMesh mesh = tests::icosphere(2);
        mesh.triangles.erase(mesh.triangles.begin() + 7,
                             mesh.triangles.begin() + 7 + static_cast<std::ptrdiff_t>(gone));
        const PreparedModel model = prepare(mesh);
        check_all_vertices_kept(mesh, model);
        if (gone == 1) CHECK(model.solid.positions.size() == mesh.positions.size());
        CHECK(common::analyse_topology(model.solid).euler == 2);
    }
    // An open tube has two rims.
    const TriangleMesh tube = without(tests::box({1, 1, 4}, 4), [](const Vector3d& center) {
        return std::abs(center.z()) > 1.99;
    });
    const PreparedModel model = prepare(tube);
    CHECK(model.warnings == Lines{"ignored 18 vertices that no face uses", "filled 2 holes"});
    CHECK(common::signed_volume(model.solid) == Approx(4.0));
}

TEST_CASE("vertices that nothing uses and copies of a position go, the rest keep their order") {
    TriangleMesh mesh;  // a cube whose twelve triangles share nothing, and a stray vertex in front
    mesh.positions.emplace_back(9, 9, 9);
    const TriangleMesh cube = tests::cube();
    for (const Triangle& t : cube.triangles) {
        const auto base = static_cast<std::uint32_t>(mesh.positions.size());
        for (const std::uint32_t v : t) mesh.positions.push_back(cube.positions[v]);
        mesh.triangles.push_back({base, base + 1, base + 2});
    }
    const PreparedModel model = prepare(mesh);
    check_all_vertices_kept(mesh, model);
    CHECK(model.vertices.size() == 8);
    CHECK(model.warnings == Lines{"ignored 1 vertex that no face uses",
                                  "merged 28 vertices with others at the same positions"});
    CHECK(common::signed_volume(model.solid) == Approx(1.0));
}

TEST_CASE("minus zero is zero, and the first of equals keeps its bits") {
    TriangleMesh mesh = tests::translated(tests::cube(), Vector3d::Constant(0.5));
    TriangleMesh copy = mesh;
    for (Vector3d& p : copy.positions) {
        for (double& x : p) x = x == 0.0 ? -0.0 : x;
    }
    TriangleMesh both = tests::join(copy, mesh);
    both.triangles.erase(both.triangles.begin(), both.triangles.begin() + 6);
    both.triangles.resize(12);  // half on the copy, half on the original
    const PreparedModel model = prepare(both);
    CHECK(model.vertices.size() == 8);
    CHECK(std::signbit(model.vertices[0][0]));
}

TEST_CASE("degenerate and duplicate triangles go, with the vertices that only they used") {
    const PreparedModel model = prepare(tests::with_degenerates());
    CHECK(model.solid.positions == tests::cube().positions);
    CHECK(model.solid.triangles == tests::cube().triangles);
    CHECK(model.warnings == Lines{"ignored 1 vertex that no face uses",
                                  "dropped 3 degenerate faces", "dropped 3 duplicate faces"});
}

TEST_CASE("a triangle without area stays where it seals a seam") {
    TriangleMesh mesh = tests::cube();
    // Put a vertex on an edge for the triangle on one side of it only; a sliver closes the gap.
    const Triangle t = mesh.triangles[0];
    const auto m = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(0.5 * (mesh.positions[t[0]] + mesh.positions[t[1]]));
    mesh.triangles[0] = {t[0], m, t[2]};
    mesh.triangles.push_back({m, t[1], t[2]});
    mesh.triangles.push_back({t[0], t[1], m});
    const PreparedModel model = prepare(mesh);
    CHECK(model.warnings.empty());
    CHECK(model.vertices.size() == 9);
}

TEST_CASE("bodies that touch along an edge or at a corner come apart") {
    const PreparedModel edge = prepare(tests::edge_shared_by_four());
    check_all_vertices_kept(tests::edge_shared_by_four(), edge);
    CHECK(edge.solid.positions.size() == 16);
    CHECK(common::analyse_topology(edge.solid).components == 2);
    CHECK(common::signed_volume(edge.solid) == Approx(2.0));
    CHECK(edge.warnings == Lines{"split 1 edge shared by more than two faces",
                                 "split 2 vertices where surfaces met",
                                 "the model has 2 separate parts"});
    const PreparedModel corner = prepare(tests::vertex_shared_by_two());
    CHECK(corner.vertices.size() == 15);
    CHECK(corner.solid.positions.size() == 16);
    CHECK(common::analyse_topology(corner.solid).components == 2);
    CHECK(common::signed_volume(corner.solid) == Approx(2.0));
}

TEST_CASE("a body that touches itself along an edge stays one") {
    const PreparedModel model = prepare(tests::edge_touching_itself());
    check_all_vertices_kept(tests::edge_touching_itself(), model);
    const MeshTopology topology = common::analyse_topology(model.solid);
    CHECK(topology.components == 1);
    CHECK(topology.genus() == 1);  // two plates on two pillars
    CHECK(common::signed_volume(model.solid) == Approx(10.0));
}

TEST_CASE("orientation is made consistent and outward") {
    const double sphere = common::signed_volume(tests::icosphere(3));
    const PreparedModel mixed = prepare(tests::inconsistent_orientation());
    CHECK(common::signed_volume(mixed.solid) == Approx(sphere));
    CHECK(mixed.warnings.front() == "turned 640 faces to agree with their neighbours");

    const PreparedModel turned = prepare(inside_out(tests::icosphere(3)));
    CHECK(common::signed_volume(turned.solid) == Approx(sphere));
    CHECK(turned.warnings == Lines{"turned 1 part inside out"});

    TriangleMesh minority = tests::icosphere(3);
    for (std::size_t t = 0; t < 1280; t += 5)
        std::swap(minority.triangles[t][0], minority.triangles[t][1]);
    const PreparedModel few = prepare(minority);
    CHECK(few.warnings == Lines{"turned 256 faces to agree with their neighbours"});
    CHECK(common::signed_volume(few.solid) == Approx(sphere));

    // One of two touching cubes inside out: still two cubes.
    TriangleMesh touching = tests::edge_shared_by_four();
    for (std::size_t t = 12; t < 24; ++t)
        std::swap(touching.triangles[t][1], touching.triangles[t][2]);
    CHECK(common::signed_volume(prepare(touching).solid) == Approx(2.0));
}

TEST_CASE("a Moebius strip is cut open and closed up") {
    for (const int n : {3, 4, 7, 12, 40}) {
        INFO(n);
        const TriangleMesh strip = tests::moebius_strip(n);
        const PreparedModel model = prepare(strip);
        check_all_vertices_kept(strip, model);
        CHECK(common::analyse_topology(model.solid).components == 1);
        CHECK(std::count(model.warnings.begin(), model.warnings.end(),
                         "cut a one-sided surface open at 1 edge") == 1);
    }
}

TEST_CASE("a cavity stays a cavity, whichever way the whole file is turned") {
    const double outer = common::signed_volume(tests::icosphere(3));
    const double inner = common::signed_volume(tests::icosphere(2, 0.5));
    const TriangleMesh shells = tests::nested_shells();
    const PreparedModel model = prepare(shells);
    CHECK(model.solid.triangles == shells.triangles);
    CHECK(common::signed_volume(model.solid) == Approx(outer - inner));
    const PreparedModel turned = prepare(inside_out(shells));
    CHECK(common::signed_volume(turned.solid) == Approx(outer - inner));
    CHECK(turned.warnings.front() == "turned 2 parts inside out");

    // An island in the cavity is solid, however it faces; a body inside a body stays a body.
    for (const bool flip : {false, true}) {
        const TriangleMesh island = tests::icosphere(1, 0.2);
        const TriangleMesh three = tests::join(shells, flip ? inside_out(island) : island);
        CHECK(common::signed_volume(prepare(three).solid) ==
              Approx(outer - inner + common::signed_volume(island)));
        const TriangleMesh within = tests::join(tests::icosphere(3), tests::icosphere(2, 0.5));
        CHECK(common::signed_volume(prepare(flip ? inside_out(within) : within).solid) ==
              Approx(outer + inner));
    }
}

TEST_CASE("parts beside each other are each turned outward, many of them too") {
    TriangleMesh many;
    for (int i = 0; i < 12; ++i) {
        for (int j = 0; j < 12; ++j) {
            const TriangleMesh one = tests::translated(tests::cube(), Vector3d(2 * i, 2 * j, i));
            many = tests::join(many, (i + j) % 3 == 0 ? inside_out(one) : one);
        }
    }
    const PreparedModel model = prepare(many);
    CHECK(common::signed_volume(model.solid) == Approx(144.0));
    CHECK(model.warnings ==
          Lines{"turned 48 parts inside out", "the model has 144 separate parts"});
}

TEST_CASE("overlapping and disjoint parts are kept and mentioned") {
    for (const TriangleMesh& mesh : {tests::two_parts(), tests::overlapping_parts()}) {
        const PreparedModel model = prepare(mesh);
        CHECK(model.solid.triangles == mesh.triangles);
        CHECK(model.warnings == Lines{"the model has 2 separate parts"});
    }
}

TEST_CASE("a wall between two bodies cancels, a double-faced sheet keeps one side") {
    TriangleMesh two = tests::cube();
    two = tests::join(two, tests::translated(tests::cube(), Vector3d(1, 0, 0)));
    // Only a wall cut along the same diagonal on both sides is a pair of duplicates.
    std::set<std::set<Place>> faces;
    std::size_t same = 0;
    for (const Triangle& t : two.triangles) {
        std::set<Place> corners;
        for (const std::uint32_t v : t) corners.insert(place(two.positions[v]));
        if (!faces.insert(corners).second) ++same;
    }
    const PreparedModel model = prepare(two);
    CHECK(model.vertices.size() == 12);
    CHECK(common::signed_volume(model.solid) == Approx(2.0));
    CHECK(common::analyse_topology(model.solid).components == (same == 2 ? 1 : 2));

    const TriangleMesh sheet = tests::open_hemisphere(3);
    const PreparedModel shell = prepare(tests::join(sheet, inside_out(sheet)));
    CHECK(common::signed_volume(shell.solid) ==
          Approx(common::signed_volume(prepare(sheet).solid)));
}

TEST_CASE("a fin on a body does no harm") {
    TriangleMesh mesh = tests::cube();
    mesh.positions.emplace_back(2, 2, 2);
    const Triangle t = mesh.triangles[3];
    mesh.triangles.push_back({t[0], t[1], 8});
    const PreparedModel model = prepare(mesh);
    check_all_vertices_kept(mesh, model);
    CHECK(common::signed_volume(model.solid) == Approx(1.0).epsilon(0.3));
}

TEST_CASE("what encloses nothing is refused with a reason") {
    using Catch::Contains;
    CHECK_THROWS_WITH(prepare_model({}), Contains("no faces"));
    TriangleMesh mesh = tests::cube();
    mesh.triangles.assign(5, {1, 1, 2});
    CHECK_THROWS_WITH(prepare_model(mesh), Contains("degenerate"));
    TriangleMesh flat = tests::cube();
    for (Vector3d& p : flat.positions) p.z() = 0;
    CHECK_THROWS_WITH(prepare_model(flat), Contains("no volume") || Contains("no faces"));
    mesh = tests::cube();
    mesh.triangles.resize(1);
    CHECK_THROWS_WITH(prepare_model(mesh), Contains("no volume"));
    mesh = tests::cube();
    for (Vector3d& p : mesh.positions) p.z() *= 1e-10;
    CHECK_THROWS_WITH(prepare_model(mesh), Contains("no volume"));
    mesh = tests::cube();
    mesh.triangles[4][2] = 8;
    CHECK_THROWS_AS(prepare_model(mesh), std::invalid_argument);
    mesh.triangles[4][2] = 0;
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, -1e300}) {
        mesh.positions[0][1] = bad;
        CHECK_THROWS_AS(prepare_model(mesh), std::invalid_argument);
        mesh.positions[3][2] = bad;
        CHECK_THROWS_AS(prepare_model(mesh), std::invalid_argument);
        mesh.positions[3][2] = 0;
    }
}

TEST_CASE("scale and place change nothing but rounding") {
    const TriangleMesh mesh = tests::join(
        tests::open_hemisphere(3), tests::translated(tests::nested_shells(), Vector3d(4, 0, 0)));
    const Lines expected = prepare(mesh).warnings;
    for (const double scale : {1e-12, 1e12}) {
        TriangleMesh other = mesh;
        for (Vector3d& p : other.positions) p = scale * (p + Vector3d(1000, 0, 0));
        CHECK(prepare(other).warnings == expected);
    }
}

// Any triangles at all over a few vertices.
TriangleMesh random_soup(common::Random& random) {
    TriangleMesh mesh;
    const std::size_t vertices = 4 + random.below(8);
    for (std::size_t v = 0; v < vertices; ++v) {
        const double step = random.chance(0.5) ? 1.0 : 0.37;  // some positions coincide
        mesh.positions.emplace_back(step * static_cast<double>(random.below(3)),
                                    step * static_cast<double>(random.below(3)),
                                    step * static_cast<double>(random.below(3)));
    }
    const std::size_t triangles = 1 + random.below(30);
    for (std::size_t t = 0; t < triangles; ++t) {
        Triangle triangle{};
        for (std::uint32_t& v : triangle) v = static_cast<std::uint32_t>(random.below(vertices));
        mesh.triangles.push_back(triangle);
    }
    return mesh;
}

TEST_CASE("any soup of triangles becomes a closed manifold or is refused") {
    int prepared = 0;
    for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
        INFO("seed " << seed);
        common::Random random(seed);
        const TriangleMesh soup = random_soup(random);
        try {
            prepare(soup);
            ++prepared;
        } catch (const std::invalid_argument&) {
        }
    }
    CHECK(prepared > 500);
}

TEST_CASE("a surface with pieces torn out, turned and doubled is mended") {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        INFO("seed " << seed);
        common::Random random(seed);
        TriangleMesh mesh = random.chance(0.5) ? tests::icosphere(2) : tests::double_torus(2);
        std::erase_if(mesh.triangles, [&](const Triangle&) { return random.chance(0.1); });
        for (Triangle& t : mesh.triangles) {
            if (random.chance(0.1)) std::swap(t[0], t[1]);
        }
        const std::vector<Triangle> original = mesh.triangles;
        for (const Triangle& t : original) {
            if (random.chance(0.05)) mesh.triangles.push_back(t);
        }
        common::shuffle(mesh.triangles, random);
        check_all_vertices_kept(mesh, prepare(mesh));
    }
}

ShapePromise promised(const TriangleMesh& mesh, unsigned threads = 1) {
    return promise_topology(prepare_model(mesh), threads);
}

void check_promise(const ShapePromise& promise, int components, int euler_all, int euler_largest) {
    CHECK_FALSE(promise.approximate);
    CHECK(promise.reason.empty());
    CHECK(promise.components == static_cast<std::uint32_t>(components));
    CHECK(promise.euler_all == euler_all);
    CHECK(promise.euler_largest == euler_largest);
}

TEST_CASE("the promise is the model's own topology where voxels see it") {
    check_promise(promised(tests::cube()), 1, 2, 2);
    check_promise(promised(tests::open_hemisphere(3)), 1, 2, 2);
    check_promise(promised(tests::torus(1, 0.3, 32, 24)), 1, 0, 0);
    check_promise(promised(tests::double_torus(2)), 1, -2, -2);
    check_promise(promised(tests::two_parts()), 2, 4, 2);
    check_promise(promised(tests::edge_touching_itself()), 1, 0, 0);
    check_promise(promised(tests::inconsistent_orientation()), 1, 2, 2);
    check_promise(promised(tests::join(tests::translated(tests::icosphere(3), Vector3d(5, 0, 0)),
                                       tests::torus(3, 0.3, 32, 24))),
                  2, 2, 0);
}

TEST_CASE("a cavity is part of the promise, a body inside a body is not") {
    // Winding is 0 inside a shell that faces inward: the solid's boundary has two components.
    check_promise(promised(tests::nested_shells()), 2, 4, 2);
    check_promise(promised(inside_out(tests::nested_shells())), 2, 4, 2);
    const ShapePromise within =
        promised(tests::join(tests::icosphere(3), tests::icosphere(2, 0.5)));
    CHECK(within.approximate);
    CHECK(within.components == 1);
    CHECK(within.euler_all == 2);
}

TEST_CASE("where parts overlap, their union is promised, approximately") {
    const ShapePromise promise = promised(tests::overlapping_parts());
    CHECK(promise.approximate);
    CHECK(promise.components == 1);
    CHECK(promise.euler_all == 2);
    CHECK(promise.euler_largest == 2);
    CHECK_THAT(promise.reason, Catch::Contains("2 components of Euler characteristic 4"));
    CHECK_THAT(promise.reason, Catch::Contains("1 component of Euler characteristic 2"));
    CHECK(promise.reason.find('\n') == std::string::npos);
}

TEST_CASE("what is too thin for the first grid is seen by a finer one, or promised approximately") {
    // A ring 2 + 2 * 0.009 wide: about 0.9 cells thick at 96 cells, 2.3 at 256.
    check_promise(promised(tests::torus(1, 0.009, 96, 12)), 1, 0, 0);
    const ShapePromise hair = promised(
        tests::join(tests::box({1, 0.0004, 0.0004}, 1), tests::box({0.0004, 1, 0.0004}, 1)));
    CHECK(hair.approximate);
    CHECK(hair.components >= 1);
    PreparedModel plate = prepare_model(tests::box({1, 1, 0.001}, 1));
    for (Vector3d& p : plate.solid.positions) p += Vector3d(0, 0, 0.3 * p.x());  // on no lattice
    const ShapePromise thin = promise_topology(plate, 1);
    CHECK(thin.approximate);
    CHECK_FALSE(thin.reason.empty());
    CHECK(thin.components >= 1);
}

TEST_CASE("threads do not change the promise") {
    for (const TriangleMesh& mesh : {tests::overlapping_parts(), tests::double_torus(1)}) {
        const ShapePromise one = promised(mesh, 1);
        const ShapePromise two = promised(mesh, 2);
        CHECK(one.components == two.components);
        CHECK(one.euler_all == two.euler_all);
        CHECK(one.euler_largest == two.euler_largest);
        CHECK(one.reason == two.reason);
    }
}

TEST_CASE("the reference models need nothing done") {
    const auto models = tests::models_dir();
    if (!models) {
        WARN("no reference models: set ELLICAST_MODELS; skipped");
        return;
    }
    struct Expected {
        const char* name;
        std::size_t vertices;
        int genus;
    };
    for (const auto& [name, vertices, genus] :
         {Expected{"horse", 48485, 0}, Expected{"stanford-bunny", 34834, 0},
          Expected{"rocker-arm", 10044, 1}, Expected{"spot", 2930, 0},
          Expected{"fertility", 4494, 4}, Expected{"homer", 6002, 0}}) {
        INFO(name);
        const TriangleMesh mesh = common::read_model(*models / (std::string(name) + ".ply"));
        const PreparedModel model = prepare_model(mesh);
        CHECK(model.warnings.empty());
        CHECK(model.vertices.size() == vertices);
        CHECK(model.solid.triangles == mesh.triangles);
        CHECK(std::equal(model.vertices.begin(), model.vertices.end(), mesh.positions.begin(),
                         mesh.positions.end(), same_bits));
        const MeshTopology topology = common::analyse_topology(model.solid);
        CHECK(topology.closed);
        CHECK(topology.manifold);
        CHECK(topology.genus() == genus);
        CHECK(common::signed_volume(model.solid) > 0);

        const ShapePromise promise = promise_topology(model);
        CHECK(promise.components == 1);
        CHECK(promise.euler_all == 2 - 2 * genus);
        CHECK(promise.euler_largest == 2 - 2 * genus);
        CHECK_FALSE(promise.approximate);
    }
}

}  // namespace
}  // namespace ellicast::sender
