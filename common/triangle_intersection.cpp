// common/triangle_intersection.cpp
#include "common/triangle_intersection.hpp"

#include <algorithm>
#include <cstddef>

#include "common/exact_orientation.hpp"

namespace ellicast::common {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using FlatCorners = std::array<Vector2d, 3>;
using Signs = std::array<int, 3>;

constexpr std::array<std::size_t, 3> kNext{1, 2, 0};

bool all_equal(const Signs& s, int value) {
    return s[0] == value && s[1] == value && s[2] == value;
}

// No two of them opposite.
bool agree(const Signs& s) {
    const auto [low, high] = std::minmax({s[0], s[1], s[2]});
    return low >= 0 || high <= 0;
}

bool segments_meet(const Vector2d& p, const Vector2d& q, const Vector2d& r, const Vector2d& s) {
    // Boxes first; they also decide for segments on one line, and for points.
    if ((p.cwiseMax(q).array() < r.cwiseMin(s).array()).any()) return false;
    if ((r.cwiseMax(s).array() < p.cwiseMin(q).array()).any()) return false;
    return orientation(p, q, r) * orientation(p, q, s) <= 0 &&
           orientation(r, s, p) * orientation(r, s, q) <= 0;
}

// False for a triangle without area: its edges tell.
bool contains(const FlatCorners& t, const Vector2d& p) {
    const Signs signs{orientation(t[0], t[1], p), orientation(t[1], t[2], p),
                      orientation(t[2], t[0], p)};
    return agree(signs) && !all_equal(signs, 0);
}

bool flat_triangles_meet(const FlatCorners& s, const FlatCorners& t) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            if (segments_meet(s[i], s[kNext[i]], t[j], t[kNext[j]])) return true;
        }
    }
    return contains(s, t[0]) || contains(t, s[0]);
}

// Projection along a coordinate axis, which is exact.
FlatCorners projected(const TriangleCorners& t, int axis) {
    FlatCorners flat;
    for (std::size_t c = 0; c < 3; ++c) flat[c] = {t[c][(axis + 1) % 3], t[c][(axis + 2) % 3]};
    return flat;
}

// Whether all six corners lie in one plane, given that neither triangle has a corner off the plane
// of the other. Two triangles without area can be skew all the same.
bool coplanar(const TriangleCorners& s, const TriangleCorners& t) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            if (orientation(s[i], s[kNext[i]], t[j], t[kNext[j]]) != 0) return false;
        }
    }
    return true;
}

// At least one of the three projections maps the common plane one to one, and there the answer is
// exact; in the others, triangles that meet still meet. So all three must say yes.
bool coplanar_triangles_meet(const TriangleCorners& s, const TriangleCorners& t) {
    for (int axis = 0; axis < 3; ++axis) {
        if (!flat_triangles_meet(projected(s, axis), projected(t, axis))) return false;
    }
    return true;
}

// Sides of the corners of t, seen from the plane of s; all 0 when s has no area.
Signs sides(const TriangleCorners& s, const TriangleCorners& t) {
    return {orientation(s[0], s[1], s[2], t[0]), orientation(s[0], s[1], s[2], t[1]),
            orientation(s[0], s[1], s[2], t[2])};
}

// Whether an edge of s that is not within the plane of t meets t; `side` holds the sides of the
// corners of s.
bool edge_meets(const TriangleCorners& s, const Signs& side, const TriangleCorners& t) {
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = kNext[i];
        if (side[i] == side[j]) continue;  // beside the plane, or within it
        const Signs around{orientation(s[i], s[j], t[0], t[1]), orientation(s[i], s[j], t[1], t[2]),
                           orientation(s[i], s[j], t[2], t[0])};
        if (agree(around)) return true;
    }
    return false;
}

}  // namespace

bool triangles_meet(const TriangleCorners& s, const TriangleCorners& t) {
    const Signs t_sides = sides(s, t);
    if (all_equal(t_sides, 1) || all_equal(t_sides, -1)) return false;
    const Signs s_sides = sides(t, s);
    if (all_equal(s_sides, 1) || all_equal(s_sides, -1)) return false;
    if (all_equal(t_sides, 0) && all_equal(s_sides, 0)) {
        return coplanar(s, t) && coplanar_triangles_meet(s, t);
    }
    // Not in one plane: then where they meet, an edge of one that leaves the plane of the other
    // meets that other. (An edge within the plane is reached through its end points, which are end
    // points of edges that leave it, or through the edges of the other that it crosses.)
    return edge_meets(s, s_sides, t) || edge_meets(t, t_sides, s);
}

}  // namespace ellicast::common
