// tests/common/triangle_tree_test.cpp
#include "common/triangle_tree.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"

namespace {

using namespace ellicast::common;
using Eigen::Vector3d;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

Vector3d random_point(Random& random, double half_side) {
    Vector3d p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = half_side * (2.0 * random.uniform() - 1.0);
    return p;
}

// The oracle: every triangle, in index order.
TriangleTree::Hit closest_by_brute_force(const TriangleMesh& mesh, const Vector3d& x,
                                         double max_squared_distance) {
    TriangleTree::Hit best;
    double least = max_squared_distance;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& [a, b, c] = mesh.triangles[i];
        const TrianglePoint hit =
            closest_point_on_triangle(x, mesh.positions[a], mesh.positions[b], mesh.positions[c]);
        const double d2 = (x - hit.point).squaredNorm();
        if (d2 < least || (d2 == least && best.triangle == kNone)) {
            least = d2;
            best = {static_cast<std::uint32_t>(i), hit.point, hit.barycentric, d2};
        }
    }
    return best;
}

void require_same(const TriangleTree::Hit& a, const TriangleTree::Hit& b) {
    REQUIRE(a.triangle == b.triangle);
    REQUIRE(a.squared_distance == b.squared_distance);
    REQUIRE(a.point == b.point);
    REQUIRE(a.barycentric == b.barycentric);
}

void require_agreement(const TriangleMesh& mesh, Random& random, int queries, double reach) {
    const TriangleTree tree(mesh);
    for (int q = 0; q < queries; ++q) {
        const Vector3d x = random_point(random, reach);
        const double limit =
            q % 3 == 0 ? reach * reach * random.uniform() : std::numeric_limits<double>::infinity();
        require_same(tree.closest(x, limit), closest_by_brute_force(mesh, x, limit));
    }
}

// Triangles of all proportions: some points, some segments, some on a coarse lattice so that ties
// and shared corners abound.
TriangleMesh random_soup(Random& random, std::size_t count) {
    TriangleMesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const bool on_lattice = random.chance(0.3);
        const double size = std::pow(10.0, -4.0 * random.uniform());
        const Vector3d center = random_point(random, 1.0);
        std::array<Vector3d, 3> corner;
        for (Vector3d& p : corner) {
            p = on_lattice ? Vector3d((3.0 * random_point(random, 1.0)).array().round() / 3.0)
                           : Vector3d(center + random_point(random, size));
        }
        if (random.chance(0.1)) corner[1] = corner[0];
        if (random.chance(0.1)) corner[2] = 0.25 * corner[0] + 0.75 * corner[1];
        if (random.chance(0.05)) corner[1] = corner[2] = corner[0];
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), corner.begin(), corner.end());
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

}  // namespace

TEST_CASE("the closest point of a triangle is known in each of its seven regions") {
    const Vector3d a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
    struct Case {
        Vector3d x, point, barycentric;
    };
    for (const Case& k :
         {Case{{1, 1, 5}, {1, 1, 0}, {0.5, 0.25, 0.25}}, Case{{-1, -2, 3}, {0, 0, 0}, {1, 0, 0}},
          Case{{9, -1, 1}, {4, 0, 0}, {0, 1, 0}}, Case{{-1, 9, 1}, {0, 4, 0}, {0, 0, 1}},
          Case{{1, -7, 2}, {1, 0, 0}, {0.75, 0.25, 0}},
          Case{{-7, 1, 2}, {0, 1, 0}, {0.75, 0, 0.25}},
          Case{{4, 4, -2}, {2, 2, 0}, {0, 0.5, 0.5}}}) {
        const TrianglePoint hit = closest_point_on_triangle(k.x, a, b, c);
        CHECK(hit.point == k.point);
        CHECK(hit.barycentric == k.barycentric);
    }
}

TEST_CASE(
    "no point of a triangle is closer than the closest point, obtuse and thin ones included") {
    const std::uint64_t seed = GENERATE(range(1, 6));
    CAPTURE(seed);
    Random random(seed);
    for (int trial = 0; trial < 300; ++trial) {
        const double flatness = std::pow(10.0, -14.0 * random.uniform());
        const Vector3d scale(1.0, flatness, flatness);
        const Vector3d a = random_point(random, 1.0).cwiseProduct(scale);
        const Vector3d b = random_point(random, 1.0).cwiseProduct(scale);
        const Vector3d c = random_point(random, 1.0).cwiseProduct(scale);
        const Vector3d x = random_point(random, random.chance(0.5) ? 1.0 : 30.0);
        const TrianglePoint hit = closest_point_on_triangle(x, a, b, c);
        const Vector3d& w = hit.barycentric;
        CHECK(w.minCoeff() >= 0.0);
        CHECK(w.sum() == Approx(1.0).epsilon(1e-14));
        CHECK((w[0] * a + w[1] * b + w[2] * c - hit.point).norm() <= 1e-14);
        const double distance = (x - hit.point).norm();
        for (int i = 0; i <= 40; ++i) {
            for (int j = 0; i + j <= 40; ++j) {
                const double u = i / 40.0;
                const double v = j / 40.0;
                const Vector3d p = u * a + v * b + (1.0 - u - v) * c;
                REQUIRE((x - p).norm() >= distance * (1.0 - 1e-12) - 1e-14);
            }
        }
    }
}

TEST_CASE("the closest point never leaves the box of its triangle") {
    Random random(11);
    for (int trial = 0; trial < 20'000; ++trial) {
        const Vector3d a = random_point(random, 1.0);
        const Vector3d b = random_point(random, 1.0);
        Vector3d c = random_point(random, 1.0);
        if (trial % 2 == 0) c[trial % 3] = b[trial % 3];
        const Eigen::AlignedBox3d box(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
        // Just inside the edge opposite a, where rounding would carry the point over.
        const double from_a = 1.0 - std::pow(10.0, -10.0 - 6.0 * random.uniform());
        const double along = random.uniform();
        const Vector3d x = a + from_a * ((1.0 - along) * (b - a) + along * (c - a));
        REQUIRE(box.contains(closest_point_on_triangle(x, a, b, c).point));
    }
}

TEST_CASE("two triangles find the same bits on the edge that they share") {
    Random random(12);
    int on_edge = 0;
    for (int trial = 0; trial < 2'000; ++trial) {
        const Vector3d a = random_point(random, 1.0);
        const Vector3d b = random_point(random, 1.0);
        const Vector3d c = random_point(random, 1.0);
        const Vector3d d = random_point(random, 1.0);
        const Vector3d x = random_point(random, 3.0);
        const TrianglePoint one = closest_point_on_triangle(x, a, b, c);
        const TrianglePoint other = closest_point_on_triangle(x, b, a, d);
        if (one.barycentric[2] != 0.0 || other.barycentric[2] != 0.0) continue;
        if (one.barycentric.maxCoeff() < 1.0) ++on_edge;
        REQUIRE(one.point == other.point);
    }
    CHECK(on_edge > 50);
}

TEST_CASE("a degenerate triangle is the segment or the point that it is") {
    const Vector3d a(0, 0, 0), b(2, 0, 0), middle(1, 0, 0);
    const Vector3d x(1.5, 1, 0);
    for (const auto& [p, q, r] :
         {std::array{a, b, middle}, std::array{a, middle, b}, std::array{middle, a, b},
          std::array{a, a, b}, std::array{b, a, a}, std::array{a, b, a}}) {
        const TrianglePoint hit = closest_point_on_triangle(x, p, q, r);
        CHECK(hit.point == Vector3d(1.5, 0, 0));
        const Vector3d& w = hit.barycentric;
        CHECK(Vector3d(w[0] * p + w[1] * q + w[2] * r) == hit.point);
    }
    const TrianglePoint hit = closest_point_on_triangle(x, b, b, b);
    CHECK(hit.point == b);
    CHECK(hit.barycentric.sum() == 1.0);
}

TEST_CASE("an empty tree has no closest triangle") {
    CHECK(TriangleTree().closest(Vector3d::Zero()).triangle == kNone);
    const TriangleTree tree{TriangleMesh{}};
    CHECK(tree.empty());
    CHECK(tree.closest(Vector3d::Zero()).triangle == kNone);
}

TEST_CASE("the tree finds what brute force finds, bit for bit, in random soups") {
    const std::uint64_t seed = GENERATE(range(1, 21));
    CAPTURE(seed);
    Random random(seed);
    const std::size_t count = 1 + random.below(400);
    require_agreement(random_soup(random, count), random, 300, 2.0);
}

TEST_CASE("the tree finds what brute force finds on closed shapes and on the zoo") {
    using namespace ellicast::tests;
    Random random(7);
    require_agreement(icosphere(3), random, 300, 1.5);
    require_agreement(torus(1.0, 0.3, 30, 12), random, 300, 1.5);
    require_agreement(with_degenerates(), random, 300, 1.5);
    require_agreement(vertex_shared_by_two(), random, 300, 2.5);
    require_agreement(moebius_strip(20), random, 300, 1.5);
    // Far from the origin the float boxes are coarse, but they still hold their triangles.
    const Vector3d far(5e6, -3e5, 1e7);
    const TriangleMesh shifted = translated(icosphere(2), far);
    const TriangleTree tree(shifted);
    for (int q = 0; q < 100; ++q) {
        const Vector3d x = far + random_point(random, 2.0);
        const double no_limit = std::numeric_limits<double>::infinity();
        require_same(tree.closest(x), closest_by_brute_force(shifted, x, no_limit));
    }
}

TEST_CASE("ties go to the smallest triangle index") {
    using namespace ellicast::tests;
    // The same sphere forty times over: every answer must come from the first copy.
    TriangleMesh mesh = icosphere(1);
    const std::size_t first_copy = mesh.triangles.size();
    for (int copy = 1; copy < 40; ++copy) {
        for (std::size_t i = 0; i < first_copy; ++i) {
            const auto& [a, b, c] = mesh.triangles[i];
            mesh.triangles.push_back({b, c, a});
        }
    }
    const TriangleTree tree(mesh);
    Random random(3);
    for (int q = 0; q < 200; ++q) {
        const Vector3d x = random_point(random, 2.0);
        const double no_limit = std::numeric_limits<double>::infinity();
        const auto hit = tree.closest(x);
        require_same(hit, closest_by_brute_force(mesh, x, no_limit));
    }
    // From the centre of a cube six faces are equally far; over an edge and over a corner all of
    // its triangles are.
    const TriangleMesh box = cube(2.0);
    const TriangleTree box_tree(box);
    CHECK(box_tree.closest(Vector3d::Zero()).triangle == 0);
    for (const Vector3d& x : {Vector3d(3, 3, 3), Vector3d(-3, 3, 3), Vector3d(2, 0.3, 2)}) {
        require_same(box_tree.closest(x),
                     closest_by_brute_force(box, x, std::numeric_limits<double>::infinity()));
    }
}

TEST_CASE("the limit on the distance includes its own value") {
    const TriangleMesh mesh = ellicast::tests::cube(2.0);
    const TriangleTree tree(mesh);
    const Vector3d x(4, 0.25, 0.5);
    CHECK(tree.closest(x, 9.0).squared_distance == 9.0);
    CHECK(tree.closest(x, std::nextafter(9.0, 0.0)).triangle == kNone);
    CHECK(std::isinf(tree.closest(x, 1.0).squared_distance));
}

TEST_CASE("triangles in one place do not make the tree deep") {
    // 20 000 triangles with one centre, and a chain whose sizes fall by a constant factor.
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < 20'000; ++i) {
        const double s = i < 10'000 ? 1.0 : std::pow(0.93, i - 10'000.0);
        const double at = i < 10'000 ? 0.0 : 10.0 * s;
        for (const Vector3d& p : {Vector3d(-s, -s, 0), Vector3d(s, -s, 0), Vector3d(0, 2 * s, 0)}) {
            mesh.positions.push_back(p + Vector3d(at, 0, 0));
        }
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    Random random(5);
    require_agreement(mesh, random, 20, 12.0);
}
