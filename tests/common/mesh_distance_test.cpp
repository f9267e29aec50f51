// tests/common/mesh_distance_test.cpp
#include "common/mesh_distance.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/triangle_tree.hpp"
#include "tests/support/meshes.hpp"

namespace {

using namespace ellicast::common;
using namespace ellicast::tests;
using Eigen::Vector3d;

// A square of side 2 around the z axis at height z, in n x n x 2 triangles.
TriangleMesh square(double z, int n) {
    TriangleMesh mesh;
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i) {
            mesh.positions.emplace_back(2.0 * i / n - 1.0, 2.0 * j / n - 1.0, z);
        }
    }
    const auto at = [n](int i, int j) { return static_cast<std::uint32_t>(i + j * (n + 1)); };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return mesh;
}

void require_same(const MeshDistance& a, const MeshDistance& b) {
    REQUIRE(a.rms_to_reference == b.rms_to_reference);
    REQUIRE(a.rms_from_reference == b.rms_from_reference);
    REQUIRE(a.mean_to_reference == b.mean_to_reference);
    REQUIRE(a.mean_from_reference == b.mean_from_reference);
    REQUIRE(a.max == b.max);
    REQUIRE(a.normal_deg == b.normal_deg);
}

}  // namespace

TEST_CASE("a surface is at distance nothing from itself") {
    for (const TriangleMesh& mesh : {cube(), icosphere(3), torus(2, 0.5, 20, 9), double_torus(1)}) {
        const MeshDistance d = measure_distance(mesh, mesh, {.samples = 5'000});
        CHECK(d.rms() < 1e-15);
        CHECK(d.mean() <= d.rms());
        CHECK(d.max < 1e-14);
        CHECK(d.normal_deg < 0.5);  // samples next to an edge may find the other triangle
    }
}

TEST_CASE("two parallel squares are exactly their gap apart, however they are cut") {
    const double diagonal = std::sqrt(8.0);
    const MeshDistance d = measure_distance(square(0.25, 7), square(0.0, 3), {.samples = 10'000});
    for (const double value : {d.rms_to_reference, d.rms_from_reference, d.mean_to_reference,
                               d.mean_from_reference, d.max}) {
        CHECK(value == Approx(0.25 / diagonal).epsilon(1e-13));
    }
    CHECK(d.normal_deg == 0.0);
}

TEST_CASE("a slid square is as far off as the strip that sticks out") {
    // Slid by s along x: a share s / 2 of the area sticks out, its distances even in [0, s].
    const double s = 0.5;
    const TriangleMesh slid = translated(square(0.0, 4), Vector3d(s, 0, 0));
    const MeshDistance d = measure_distance(slid, square(0.0, 4), {.samples = 40'000});
    const double diagonal = std::sqrt(8.0);
    CHECK(d.rms_to_reference * diagonal == Approx(std::sqrt(s / 2 * s * s / 3)).epsilon(0.01));
    CHECK(d.mean_to_reference * diagonal == Approx(s / 2 * s / 2).epsilon(0.01));
    CHECK(d.rms_from_reference == Approx(d.rms_to_reference).epsilon(0.01));
    CHECK(d.max * diagonal == Approx(s).epsilon(1e-14));  // a vertex finds it
}

TEST_CASE("concentric spheres are the difference of their radii apart") {
    const MeshDistance d =
        measure_distance(icosphere(4, 1.1), icosphere(4, 1.0), {.samples = 10'000});
    const double diagonal = surface_box(icosphere(4)).diagonal().norm();
    // A chord of the mesh lies below the sphere by at most e^2 / 8 for edges e of about 0.08.
    CHECK(d.rms_to_reference * diagonal == Approx(0.1).margin(1.2e-3));
    CHECK(d.rms_from_reference * diagonal == Approx(0.1).margin(1.2e-3));
    CHECK(d.mean() * diagonal == Approx(0.1).margin(1.2e-3));
    CHECK(d.max * diagonal == Approx(0.1).margin(1.5e-3));
    CHECK(d.normal_deg < 2.5);
}

TEST_CASE("a cube inside a cube has the distances of the textbook") {
    // From the inner cube of side 2 every point is 1 from the outer of side 4. Back, the distance
    // on a face is 1 over the inner face, and the excess over its rim beyond it.
    const MeshDistance d = measure_distance(cube(2), cube(4), {.samples = 40'000});
    const double diagonal = 4.0 * std::sqrt(3.0);
    CHECK(d.rms_to_reference * diagonal == Approx(1.0).epsilon(1e-13));
    CHECK(d.mean_to_reference * diagonal == Approx(1.0).epsilon(1e-13));
    CHECK(d.max * diagonal == Approx(std::sqrt(3.0)).epsilon(1e-14));
    // Mean square of (excess in u, excess in v, 1), each excess being 0 for half of a side and even
    // in [0, 1] for the other half: 1 + 2 * 1/6.
    CHECK(d.rms_from_reference * diagonal == Approx(std::sqrt(4.0 / 3.0)).epsilon(0.005));
}

TEST_CASE("distances are shares of the diagonal of the reference") {
    const TriangleMesh small = icosphere(2);
    TriangleMesh a = small, b = translated(small, Vector3d(0.1, 0, 0));
    const MeshDistance d = measure_distance(a, b, {.samples = 2'000});
    for (TriangleMesh* mesh : {&a, &b}) {
        for (Vector3d& p : mesh->positions) p *= 1024.0;
    }
    require_same(d, measure_distance(a, b, {.samples = 2'000}));
    // Vertices that no triangle uses have no say in it.
    a.positions.emplace_back(1e9, 0, 0);
    b.positions.emplace_back(0, 1e9, 0);
    require_same(d, measure_distance(a, b, {.samples = 2'000}));
}

TEST_CASE("swapping the surfaces swaps the directions") {
    const TriangleMesh a = icosphere(3);
    const TriangleMesh b = double_torus(2);
    const MeshDistance ab = measure_distance(a, b, {.samples = 5'000});
    const MeshDistance ba = measure_distance(b, a, {.samples = 5'000});
    const double ratio = surface_box(a).diagonal().norm() / surface_box(b).diagonal().norm();
    CHECK(ab.rms_to_reference == Approx(ba.rms_from_reference * ratio).epsilon(1e-13));
    CHECK(ab.rms_from_reference == Approx(ba.rms_to_reference * ratio).epsilon(1e-13));
    CHECK(ab.mean_to_reference == Approx(ba.mean_from_reference * ratio).epsilon(1e-13));
    CHECK(ab.max == Approx(ba.max * ratio).epsilon(1e-13));
    CHECK(ab.normal_deg == ba.normal_deg);
    CHECK(ab.rms() == std::max(ab.rms_to_reference, ab.rms_from_reference));
}

TEST_CASE("the normal deviation is the angle of a tilted plane, and 180 degrees seen from behind") {
    const double angle = 0.1;
    TriangleMesh tilted = square(0.0, 8);
    for (Vector3d& p : tilted.positions) {
        p = Vector3d(p[0] * std::cos(angle), p[1], p[0] * std::sin(angle));
    }
    const MeshDistance d = measure_distance(tilted, square(0.0, 8), {.samples = 1'000});
    CHECK(d.normal_deg == Approx(angle * 180.0 / 3.14159265358979).epsilon(1e-9));
    TriangleMesh behind = square(0.0, 8);
    for (Triangle& t : behind.triangles) std::swap(t[0], t[1]);
    CHECK(measure_distance(behind, square(0.0, 8), {.samples = 1'000}).normal_deg ==
          Approx(180.0).epsilon(1e-14));
}

TEST_CASE("threads do not change a bit of the distance") {
    const TriangleMesh a = icosphere(4);
    const TriangleMesh b = torus(0.8, 0.3, 40, 20);
    const MeshDistance one = measure_distance(a, b, {.samples = 5'001, .threads = 1});
    for (const unsigned threads : {0u, 2u, 3u, 7u}) {
        require_same(one, measure_distance(a, b, {.samples = 5'001, .threads = threads}));
    }
}

TEST_CASE("samples are even in area and lie on their triangles") {
    // A wide range of areas, zero ones among them, first, last and between.
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {5, 3, 0}, {9, 9, 9}};
    mesh.triangles = {{0, 0, 1}, {0, 1, 2}, {5, 5, 5}, {0, 3, 4}, {1, 3, 1}};
    const std::size_t count = 8'000;
    const std::vector<SurfaceSample> samples = sample_surface(mesh, count, 3);
    REQUIRE(samples.size() == count);
    std::vector<std::size_t> of_triangle(5, 0);
    Vector3d sum = Vector3d::Zero();
    for (const SurfaceSample& s : samples) {
        ++of_triangle[s.triangle];
        const Triangle& t = mesh.triangles[s.triangle];
        const TrianglePoint nearest = closest_point_on_triangle(
            s.point, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
        REQUIRE((nearest.point - s.point).norm() < 1e-14);
        if (s.triangle == 3) sum += s.point;
    }
    // Areas 0.5 and 7.5: stratification leaves no chance of more than one sample off.
    CHECK(of_triangle[0] + of_triangle[2] + of_triangle[4] == 0);
    CHECK(of_triangle[1] >= count / 16 - 1);
    CHECK(of_triangle[1] <= count / 16 + 1);
    const Vector3d middle = sum / static_cast<double>(of_triangle[3]);
    CHECK((middle - Vector3d(10.0 / 3.0, 1, 0)).norm() < 0.05);
}

TEST_CASE("another seed takes other samples and says nearly the same") {
    const TriangleMesh a = icosphere(3);
    const TriangleMesh b = translated(icosphere(3), Vector3d(0.2, 0.1, 0));
    const MeshDistance one = measure_distance(a, b, {.samples = 20'000, .seed = 1});
    const MeshDistance two = measure_distance(a, b, {.samples = 20'000, .seed = 2});
    CHECK(one.rms() != two.rms());
    CHECK(one.rms() == Approx(two.rms()).epsilon(0.005));
}

TEST_CASE("a surface without area is refused") {
    const TriangleMesh good = cube();
    TriangleMesh flat;
    flat.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    flat.triangles = {{0, 1, 2}, {0, 0, 1}};
    TriangleMesh not_finite = cube();
    not_finite.positions[3][1] = std::numeric_limits<double>::quiet_NaN();
    TriangleMesh infinite = cube();
    infinite.positions[3][1] = std::numeric_limits<double>::infinity();
    for (const TriangleMesh& bad : {TriangleMesh{}, flat, not_finite, infinite}) {
        CHECK_THROWS_AS(measure_distance(bad, good), std::invalid_argument);
        CHECK_THROWS_AS(measure_distance(good, bad), std::invalid_argument);
    }
    CHECK_THROWS_AS(measure_distance(good, good, {.samples = 0}), std::invalid_argument);
}
