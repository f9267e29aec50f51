// receiver/concealment.cpp
#include "receiver/concealment.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/parallel.hpp"
#include "common/vertex_normals.hpp"

namespace ellicast::receiver {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

constexpr std::uint32_t kNoMidpoint = 0xffffffffU;
// Shares of what the normals at the ends and the other diagonal ask for: least squares over 24
// edge sets (six models at 30 to 90 % loss), where they halve the error that is left on average.
constexpr double kHarmonic = 0.7;
constexpr double kDiagonal = 0.1;
// The coarse surface counts as much as the normals where its doubt is 1 / sqrt(kTrust) of the bulge
// that they ask for, or of this share of the edge, whichever is more.
constexpr double kTrust = 3.0;
constexpr double kLeastBulge = 0.013;
// The most that a midpoint may leave its edge, as a share of the edge.
constexpr double kMostBulge = 0.15;
constexpr int kMostLevels = 3;
constexpr int kMostHalvings = 3;
// An edge is split again when it is longer than this many cells of the coarse surface.
constexpr double kLongEdge = 2.0;

struct Edge {
    std::uint32_t a = 0, b = 0;                         // ends
    std::array<std::uint32_t, 2> triangle{}, corner{};  // where it is side `corner`
};

std::vector<Edge> edges_of(const TriangleMesh& mesh) {
    struct Side {
        std::uint64_t key;
        std::uint32_t triangle;
        std::uint32_t corner;
    };
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint64_t a = mesh.triangles[t][k];
            const std::uint64_t b = mesh.triangles[t][(k + 1) % 3];
            sides.push_back({std::min(a, b) << 32 | std::max(a, b), t, k});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::pair(a.key, a.triangle) < std::pair(b.key, b.triangle);
    });
    std::vector<Edge> edges;
    edges.reserve(sides.size() / 2);
    for (std::size_t k = 0; k + 1 < sides.size(); k += 2) {
        assert(sides[k].key == sides[k + 1].key);
        edges.push_back({static_cast<std::uint32_t>(sides[k].key >> 32),
                         static_cast<std::uint32_t>(sides[k].key & 0xffffffffU),
                         {sides[k].triangle, sides[k + 1].triangle},
                         {sides[k].corner, sides[k + 1].corner}});
    }
    return edges;
}

// DESIGN section 7. Zero where the two normals ask for opposite sides: an inflexion, or a crease.
Vector3d harmonic_bulge(const Vector3d& p1, const Vector3d& p2, const Vector3d& n1,
                        const Vector3d& n2) {
    const Vector3d e = p2 - p1;
    const double w1 = e.dot(n1);
    const double w2 = -e.dot(n2);
    if (!(w1 * w2 > 0.0)) return Vector3d::Zero();
    return -(2.0 * w1 * w2 / (w1 + w2) / 8.0) * (n1 + n2);
}

// One level of the concealment.
class Level {
  public:
    Level(const TriangleMesh& mesh, const std::vector<KnownVertex>& vertices,
          const ShapeGuide& guide, bool first)
        : mesh_(mesh), vertices_(vertices), guide_(guide), first_(first) {}

    // Where the edge's midpoint belongs, from the midpoint; zero when nothing says that it bulges.
    [[nodiscard]] Vector3d bulge(const Edge& edge) const {
        const Vector3d& p = mesh_.positions[edge.a];
        const Vector3d& q = mesh_.positions[edge.b];
        const double length = (q - p).norm();
        if (!first_ && length < kLongEdge * guide_.cell) return Vector3d::Zero();
        Vector3d up = face_normal(edge.triangle[0]) + face_normal(edge.triangle[1]);
        if (up.norm() < kFoldedEdge) return Vector3d::Zero();
        up.normalize();
        const Vector3d middle = 0.5 * (p + q);
        const double asked =
            harmonic_bulge(p, q, vertices_[edge.a].normal, vertices_[edge.b].normal).dot(up);
        const double doubt = 0.5 * (vertices_[edge.a].doubt + vertices_[edge.b].doubt);
        const double least = kLeastBulge * length;
        const double scale = asked * asked + least * least;
        const double trust = scale / (scale + kTrust * doubt * doubt);
        const double limit = kMostBulge * length;
        const double guided =
            std::clamp((guide_.surface->closest(middle).point - middle).dot(up), -limit, limit);
        double height = (1.0 - trust) * kHarmonic * asked + trust * guided;
        if (first_) height += kDiagonal * (other_diagonal(edge) - middle).dot(up);
        return std::clamp(height, -limit, limit) * up;
    }

  private:
    // Sum of the two unit normals: below this they all but face each other.
    static constexpr double kFoldedEdge = 0.3;

    [[nodiscard]] Vector3d face_normal(std::uint32_t t) const {
        const auto& [a, b, c] = mesh_.triangles[t];
        const Vector3d& p = mesh_.positions[a];
        return (mesh_.positions[b] - p).cross(mesh_.positions[c] - p).normalized();
    }
    [[nodiscard]] Vector3d other_diagonal(const Edge& edge) const {
        const auto opposite = [&](std::size_t side) -> const Vector3d& {
            return mesh_
                .positions[mesh_.triangles[edge.triangle[side]][(edge.corner[side] + 2) % 3]];
        };
        return 0.5 * (opposite(0) + opposite(1));
    }

    const TriangleMesh& mesh_;
    const std::vector<KnownVertex>& vertices_;
    const ShapeGuide& guide_;
    bool first_;
};

// Cuts a triangle at the midpoints of its sides: into 1 to 4.
void cut(const Triangle& t, const std::array<std::uint32_t, 3>& middle,
         const std::vector<Vector3d>& positions, std::vector<Triangle>& out) {
    const auto split = static_cast<int>(std::count_if(
        middle.begin(), middle.end(), [](std::uint32_t m) { return m != kNoMidpoint; }));
    if (split == 0) {
        out.push_back(t);
        return;
    }
    if (split == 3) {
        out.push_back({t[0], middle[0], middle[2]});
        out.push_back({t[1], middle[1], middle[0]});
        out.push_back({t[2], middle[2], middle[1]});
        out.push_back({middle[0], middle[1], middle[2]});
        return;
    }
    // Turn it so that side 0 is split and, of two, side 2 is not.
    std::size_t k = 0;
    while (middle[k] == kNoMidpoint || middle[(k + 2) % 3] != kNoMidpoint) ++k;
    const std::uint32_t a = t[k];
    const std::uint32_t b = t[(k + 1) % 3];
    const std::uint32_t c = t[(k + 2) % 3];
    const std::uint32_t m = middle[k];
    const std::uint32_t n = middle[(k + 1) % 3];
    if (split == 1) {
        out.push_back({a, m, c});
        out.push_back({m, b, c});
        return;
    }
    out.push_back({m, b, n});
    // The rest is the quad a m n c: the shorter diagonal.
    if ((positions[a] - positions[n]).squaredNorm() <=
        (positions[m] - positions[c]).squaredNorm()) {
        out.push_back({a, m, n});
        out.push_back({a, n, c});
    } else {
        out.push_back({a, m, c});
        out.push_back({m, n, c});
    }
}

// Gives every edge with a bulge its midpoint. Normals of new vertices are left open.
void split(const std::vector<Edge>& edges, const std::vector<Vector3d>& bulges,
           Concealed& concealed, std::vector<KnownVertex>& vertices) {
    TriangleMesh& mesh = concealed.mesh;
    std::vector<std::array<std::uint32_t, 3>> midpoints(mesh.triangles.size(),
                                                        {kNoMidpoint, kNoMidpoint, kNoMidpoint});
    for (std::size_t k = 0; k < edges.size(); ++k) {
        if (bulges[k] == Vector3d::Zero()) continue;
        const Edge& e = edges[k];
        const auto v = static_cast<std::uint32_t>(mesh.positions.size());
        const Vector3d middle = 0.5 * (mesh.positions[e.a] + mesh.positions[e.b]);
        mesh.positions.push_back(middle + bulges[k]);
        concealed.parents.push_back({e.a, e.b});
        vertices.push_back({Vector3d::Zero(), 0.5 * (vertices[e.a].doubt + vertices[e.b].doubt)});
        for (std::size_t side = 0; side < 2; ++side) {
            midpoints[e.triangle[side]][e.corner[side]] = v;
        }
    }
    std::vector<Triangle> triangles;
    triangles.reserve(4 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        cut(mesh.triangles[t], midpoints[t], mesh.positions, triangles);
    }
    mesh.triangles = std::move(triangles);
}

}  // namespace

Concealed conceal(const TriangleMesh& mesh, std::vector<KnownVertex> vertices,
                  const ShapeGuide& guide, double strength, unsigned threads) {
    assert(vertices.size() == mesh.positions.size());
    assert(guide.surface && guide.cell > 0.0);
    Concealed result{mesh, {}};
    for (int n = 0; n < kMostLevels; ++n) {
        const std::vector<Edge> edges = edges_of(result.mesh);
        const Level level(result.mesh, vertices, guide, n == 0);
        std::vector<Vector3d> bulges(edges.size());
        common::parallel_for(edges.size(), threads, [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) bulges[k] = strength * level.bulge(edges[k]);
        });
        const std::size_t before = result.mesh.positions.size();
        split(edges, bulges, result, vertices);
        if (result.mesh.positions.size() == before) break;
        const std::vector<Vector3d> normals = common::vertex_normals(result.mesh);
        for (std::size_t v = before; v < vertices.size(); ++v) vertices[v].normal = normals[v];
    }
    return result;
}

std::size_t flatten_intersections(Concealed& concealed, unsigned threads) {
    TriangleMesh& mesh = concealed.mesh;
    const auto& parents = concealed.parents;
    const std::size_t known = mesh.positions.size() - parents.size();
    const auto middle = [&](std::size_t k) -> Vector3d {
        return 0.5 * (mesh.positions[parents[k][0]] + mesh.positions[parents[k][1]]);
    };
    std::vector<Vector3d> bulges(parents.size());
    for (std::size_t k = 0; k < parents.size(); ++k)
        bulges[k] = mesh.positions[known + k] - middle(k);
    std::vector<int> halvings(parents.size(), 0);
    std::vector<std::uint32_t> faces = common::self_intersecting_faces(mesh, threads);
    for (;;) {
        std::vector<bool> moved(mesh.positions.size(), false);
        bool news = false;
        for (const std::uint32_t f : faces) {
            for (const std::uint32_t v : mesh.triangles[f]) {
                if (v < known || moved[v] || halvings[v - known] > kMostHalvings) continue;
                if (++halvings[v - known] > kMostHalvings) {
                    bulges[v - known].setZero();
                } else {
                    bulges[v - known] *= 0.5;
                }
                moved[v] = news = true;
            }
        }
        if (!news) return faces.size();
        // Parents come before their children, which go along.
        for (std::size_t k = 0; k < parents.size(); ++k) {
            const std::size_t v = known + k;
            moved[v] = moved[v] || moved[parents[k][0]] || moved[parents[k][1]];
            if (moved[v]) mesh.positions[v] = middle(k) + bulges[k];
        }
        std::vector<std::uint32_t> suspects;
        for (std::uint32_t f = 0, next = 0; f < mesh.triangles.size(); ++f) {
            while (next < faces.size() && faces[next] < f) ++next;
            const auto& t = mesh.triangles[f];
            const bool before = next < faces.size() && faces[next] == f;
            if (before || moved[t[0]] || moved[t[1]] || moved[t[2]]) suspects.push_back(f);
        }
        faces = common::self_intersecting_faces(mesh, suspects, threads);
    }
}

}  // namespace ellicast::receiver
