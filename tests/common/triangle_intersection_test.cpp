// tests/common/triangle_intersection_test.cpp
#include "common/triangle_intersection.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <vector>

#include "common/random.hpp"

namespace {

using namespace ellicast::common;
using Eigen::Vector3d;
using Node = Eigen::Matrix<std::int64_t, 3, 1>;
using LatticeTriangle = std::array<Node, 3>;

TriangleCorners corners(const LatticeTriangle& t) {
    return {t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>()};
}

// Every direction that may separate two triangles, segments or points.
std::vector<Node> separating_candidates(const LatticeTriangle& s, const LatticeTriangle& t) {
    std::vector<Node> edges, axes;
    for (const LatticeTriangle& triangle : {s, t}) {
        const Node e0 = triangle[1] - triangle[0];
        const Node e1 = triangle[2] - triangle[1];
        const Node e2 = triangle[0] - triangle[2];
        const Node n = e0.cross(e1);
        for (const Node& e : {e0, e1, e2}) {
            edges.push_back(e);
            axes.push_back(n.cross(e));
        }
        axes.push_back(n);
    }
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) axes.push_back(edges[i].cross(edges[3 + j]));
    }
    for (const Node& p : s) {
        for (const Node& q : t) {
            const Node d = p - q;
            axes.push_back(d);
            for (const Node& e : edges) axes.push_back(e.cross(d.cross(e)));
        }
    }
    axes.insert(axes.end(), edges.begin(), edges.end());
    return axes;
}

// The separating-axis theorem in integers: disjoint exactly when some direction leaves a gap.
bool oracle(const LatticeTriangle& s, const LatticeTriangle& t) {
    for (const Node& axis : separating_candidates(s, t)) {
        const auto [s_low, s_high] = std::minmax({axis.dot(s[0]), axis.dot(s[1]), axis.dot(s[2])});
        const auto [t_low, t_high] = std::minmax({axis.dot(t[0]), axis.dot(t[1]), axis.dot(t[2])});
        if (s_high < t_low || t_high < s_low) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("triangles on a small lattice meet exactly when no direction separates them") {
    const std::uint64_t seed = GENERATE(range(1, 7));
    CAPTURE(seed);
    Random random(seed);
    const int range = 1 + static_cast<int>(seed % 3);  // small ranges make degenerate cases common
    const bool flat = seed > 3;                        // all in one plane
    std::array<int, 2> seen{};
    for (int trial = 0; trial < 6'000; ++trial) {
        LatticeTriangle s, t;
        for (LatticeTriangle* triangle : {&s, &t}) {
            for (Node& p : *triangle) {
                for (int axis = 0; axis < 3; ++axis) {
                    const auto r = random.below(static_cast<std::size_t>(2 * range + 1));
                    p[axis] = static_cast<std::int64_t>(r) - range;
                }
                if (flat) p[2] = p[0] + 2 * p[1];
            }
        }
        const bool expected = oracle(s, t);
        ++seen[expected ? 1 : 0];
        CAPTURE(s[0].transpose(), s[1].transpose(), s[2].transpose());
        CAPTURE(t[0].transpose(), t[1].transpose(), t[2].transpose());
        REQUIRE(triangles_meet(corners(s), corners(t)) == expected);
        REQUIRE(triangles_meet(corners(t), corners(s)) == expected);
        std::rotate(s.begin(), s.begin() + 1, s.end());
        std::swap(t[0], t[2]);
        REQUIRE(triangles_meet(corners(s), corners(t)) == expected);
    }
    CHECK(seen[0] > 200);
    CHECK(seen[1] > 200);
}

TEST_CASE("a touch is a meeting and the smallest gap is none") {
    const TriangleCorners floor{Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)};
    for (const double gap : {0.0, 1e-16, 1e-80}) {
        const TriangleCorners above{Vector3d(0.25, 0.25, gap), Vector3d(1, 1, 1),
                                    Vector3d(0, 1, 1)};
        CHECK(triangles_meet(floor, above) == (gap == 0.0));
        const TriangleCorners beside{Vector3d(-gap, 0, 0), Vector3d(-1, 0, 0), Vector3d(-1, 1, 0)};
        CHECK(triangles_meet(floor, beside) == (gap == 0.0));
    }
}

TEST_CASE("triangles pierce, overlap and miss as drawn") {
    const TriangleCorners floor{Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};
    const auto moved = [](TriangleCorners t, const Vector3d& by) {
        for (Vector3d& p : t) p += by;
        return t;
    };
    const TriangleCorners spike{Vector3d(1, 1, -1), Vector3d(1.2, 1, 1), Vector3d(1, 1.2, 1)};
    CHECK(triangles_meet(floor, spike));
    CHECK_FALSE(triangles_meet(floor, moved(spike, Vector3d(3, 3, 0))));
    CHECK_FALSE(triangles_meet(floor, moved(spike, Vector3d(0, 0, 1.5))));
    // In one plane: contained, crossing, apart, parallel above.
    const TriangleCorners small{Vector3d(1, 1, 0), Vector3d(1.5, 1, 0), Vector3d(1, 1.5, 0)};
    CHECK(triangles_meet(floor, small));
    CHECK(triangles_meet(floor, moved(small, Vector3d(-1.2, 0, 0))));
    CHECK_FALSE(triangles_meet(floor, moved(small, Vector3d(-3, 0, 0))));
    CHECK_FALSE(triangles_meet(floor, moved(small, Vector3d(0, 0, 1e-12))));
    CHECK(triangles_meet(floor, floor));
}

TEST_CASE("skew segments do not meet, crossing ones do") {
    const TriangleCorners along_x{Vector3d(-1, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 0, 0)};
    const auto along_y = [](double z) {
        return TriangleCorners{Vector3d(0, -1, z), Vector3d(0, 1, z), Vector3d(0, 1, z)};
    };
    CHECK(triangles_meet(along_x, along_y(0)));
    CHECK_FALSE(triangles_meet(along_x, along_y(1e-9)));
    const TriangleCorners point{Vector3d(0.5, 0, 0), Vector3d(0.5, 0, 0), Vector3d(0.5, 0, 0)};
    CHECK(triangles_meet(along_x, point));
    CHECK_FALSE(triangles_meet(along_y(0), point));
}
