// tests/support/meshes.cpp
#include "tests/support/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace ellicast::tests {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;
using Index = std::uint32_t;

// Gives the same index to equal integer lattice points.
class Lattice {
  public:
    explicit Lattice(TriangleMesh& mesh) : mesh_(mesh) {}

    Index vertex(const std::array<int, 3>& node, const Vector3d& position) {
        const auto [it, inserted] = index_.try_emplace(node, static_cast<Index>(index_.size()));
        if (inserted) mesh_.positions.push_back(position);
        return it->second;
    }

  private:
    TriangleMesh& mesh_;
    std::map<std::array<int, 3>, Index> index_;
};

// The quad a b c d, counter-clockwise seen from outside, cut along a c.
void add_quad(TriangleMesh& mesh, Index a, Index b, Index c, Index d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
}

// Corners of the outward face of the unit cell at the origin: axis `axis`, upper or lower side.
std::array<std::array<int, 3>, 4> cell_face(int axis, bool upper) {
    const auto corner = [&](int u, int v) {
        std::array<int, 3> node{0, 0, 0};
        node[static_cast<std::size_t>(axis)] = upper ? 1 : 0;
        node[static_cast<std::size_t>((axis + 1) % 3)] = u;
        node[static_cast<std::size_t>((axis + 2) % 3)] = v;
        return node;
    };
    if (upper) return {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
    return {corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)};
}

// Boundary of the unit cells of a dims[0] x dims[1] x dims[2] block for which filled(i, j, k)
// holds, each cell scaled by `scale` and moved by `offset`.
template <class Filled>
TriangleMesh cell_surface(const std::array<int, 3>& dims, const Vector3d& scale,
                          const Vector3d& offset, const Filled& filled) {
    const auto inside = [&](const std::array<int, 3>& cell) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (cell[a] < 0 || cell[a] >= dims[a]) return false;
        }
        return filled(cell[0], cell[1], cell[2]);
    };
    TriangleMesh mesh;
    Lattice lattice(mesh);
    const auto add_face = [&](const std::array<int, 3>& cell, int axis, bool upper) {
        std::array<Index, 4> q{};
        const auto corners = cell_face(axis, upper);
        for (std::size_t c = 0; c < 4; ++c) {
            const std::array<int, 3> node{cell[0] + corners[c][0], cell[1] + corners[c][1],
                                          cell[2] + corners[c][2]};
            const Vector3d position =
                offset + scale.cwiseProduct(Vector3d(node[0], node[1], node[2]));
            q[c] = lattice.vertex(node, position);
        }
        add_quad(mesh, q[0], q[1], q[2], q[3]);
    };
    for (int k = 0; k < dims[2]; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i) {
                if (!inside({i, j, k})) continue;
                for (int axis = 0; axis < 3; ++axis) {
                    for (const int step : {-1, 1}) {
                        std::array<int, 3> neighbour{i, j, k};
                        neighbour[static_cast<std::size_t>(axis)] += step;
                        if (!inside(neighbour)) add_face({i, j, k}, axis, step > 0);
                    }
                }
            }
        }
    }
    return mesh;
}

// One 1-to-4 split; new vertices are pushed to the sphere of radius r.
TriangleMesh subdivide_on_sphere(const TriangleMesh& mesh, double r) {
    TriangleMesh fine;
    fine.positions = mesh.positions;
    std::map<std::pair<Index, Index>, Index> middle;
    const auto midpoint = [&](Index a, Index b) {
        const auto [it, inserted] = middle.try_emplace(std::minmax(a, b), 0);
        if (inserted) {
            it->second = static_cast<Index>(fine.positions.size());
            fine.positions.push_back(r * (mesh.positions[a] + mesh.positions[b]).normalized());
        }
        return it->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
        const Index ab = midpoint(a, b);
        const Index bc = midpoint(b, c);
        const Index ca = midpoint(c, a);
        fine.triangles.push_back({a, ab, ca});
        fine.triangles.push_back({ab, b, bc});
        fine.triangles.push_back({ca, bc, c});
        fine.triangles.push_back({ab, bc, ca});
    }
    return fine;
}

TriangleMesh icosahedron(double r) {
    const double g = std::numbers::phi;
    TriangleMesh mesh;
    for (const Vector3d& p :
         {Vector3d(-1, g, 0), Vector3d(1, g, 0), Vector3d(-1, -g, 0), Vector3d(1, -g, 0),
          Vector3d(0, -1, g), Vector3d(0, 1, g), Vector3d(0, -1, -g), Vector3d(0, 1, -g),
          Vector3d(g, 0, -1), Vector3d(g, 0, 1), Vector3d(-g, 0, -1), Vector3d(-g, 0, 1)}) {
        mesh.positions.push_back(r * p.normalized());
    }
    mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    return mesh;
}

// The unit cube whose lowest corner is `low`, on a lattice shared with others.
void add_unit_cube(TriangleMesh& mesh, Lattice& lattice, const std::array<int, 3>& low) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const bool upper : {false, true}) {
            std::array<Index, 4> q{};
            const auto corners = cell_face(axis, upper);
            for (std::size_t c = 0; c < 4; ++c) {
                const std::array<int, 3> node{low[0] + corners[c][0], low[1] + corners[c][1],
                                              low[2] + corners[c][2]};
                q[c] = lattice.vertex(node, Vector3d(node[0], node[1], node[2]));
            }
            add_quad(mesh, q[0], q[1], q[2], q[3]);
        }
    }
}

TriangleMesh two_unit_cubes(const std::array<int, 3>& second) {
    TriangleMesh mesh;
    Lattice lattice(mesh);
    add_unit_cube(mesh, lattice, {0, 0, 0});
    add_unit_cube(mesh, lattice, second);
    return mesh;
}

void flip(Triangle& triangle) {
    std::swap(triangle[1], triangle[2]);
}

}  // namespace

TriangleMesh cube(double side) {
    return box(Vector3d::Constant(side), 1);
}

TriangleMesh icosphere(int subdivisions, double r) {
    TriangleMesh mesh = icosahedron(r);
    for (int s = 0; s < subdivisions; ++s) mesh = subdivide_on_sphere(mesh, r);
    return mesh;
}

TriangleMesh torus(double R, double r, int nu, int nv) {
    TriangleMesh mesh;
    for (int i = 0; i < nu; ++i) {
        const double u = 2.0 * std::numbers::pi * i / nu;
        for (int j = 0; j < nv; ++j) {
            const double v = 2.0 * std::numbers::pi * j / nv;
            const double distance = R + r * std::cos(v);
            mesh.positions.emplace_back(distance * std::cos(u), distance * std::sin(u),
                                        r * std::sin(v));
        }
    }
    const auto at = [&](int i, int j) { return static_cast<Index>((i % nu) * nv + j % nv); };
    for (int i = 0; i < nu; ++i) {
        for (int j = 0; j < nv; ++j) {
            add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
    return mesh;
}

TriangleMesh double_torus(int resolution) {
    const int n = resolution;
    // A plate of 5 x 3 x 1 blocks without the blocks (1, 1) and (3, 1).
    const auto filled = [n](int i, int j, int) {
        return !(j / n == 1 && (i / n == 1 || i / n == 3));
    };
    return cell_surface({5 * n, 3 * n, n}, Vector3d::Constant(1.0 / n), Vector3d(-2.5, -1.5, -0.5),
                        filled);
}

TriangleMesh box(const Vector3d& size, int n) {
    const auto filled = [](int, int, int) { return true; };
    return cell_surface({n, n, n}, size / n, -size / 2, filled);
}

TriangleMesh open_hemisphere(int subdivisions) {
    TriangleMesh mesh;  // the upper half of an octahedron, so that the rim lies in z = 0
    mesh.positions = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    for (int s = 0; s < subdivisions; ++s) mesh = subdivide_on_sphere(mesh, 1.0);
    return mesh;
}

TriangleMesh moebius_strip(int n) {
    TriangleMesh mesh;
    for (int i = 0; i < n; ++i) {
        const double u = 2.0 * std::numbers::pi * i / n;
        for (const double t : {-0.4, 0.4}) {
            const double distance = 1.0 + t * std::cos(u / 2);
            mesh.positions.emplace_back(distance * std::cos(u), distance * std::sin(u),
                                        t * std::sin(u / 2));
        }
    }
    const auto at = [n](int i, int side) {  // a full turn swaps the sides
        return static_cast<Index>(2 * (i % n) + (i < n ? side : 1 - side));
    };
    for (int i = 0; i < n; ++i) add_quad(mesh, at(i, 0), at(i + 1, 0), at(i + 1, 1), at(i, 1));
    return mesh;
}

TriangleMesh two_parts() {
    return join(icosphere(2), translated(icosphere(2, 0.5), Vector3d(3, 0, 0)));
}

TriangleMesh overlapping_parts() {
    return join(icosphere(3), translated(icosphere(3), Vector3d(1.1, 0.2, 0.1)));
}

TriangleMesh nested_shells() {
    TriangleMesh cavity = icosphere(2, 0.5);
    for (Triangle& triangle : cavity.triangles) flip(triangle);
    return join(icosphere(3), cavity);
}

TriangleMesh edge_shared_by_four() {
    return two_unit_cubes({1, 1, 0});
}

TriangleMesh edge_touching_itself() {
    const auto filled = [](int i, int j, int k) { return k != 1 || i == j; };
    return cell_surface({2, 2, 3}, Vector3d::Ones(), Vector3d::Zero(), filled);
}

TriangleMesh vertex_shared_by_two() {
    return two_unit_cubes({1, 1, 1});
}

TriangleMesh with_degenerates() {
    TriangleMesh mesh = cube();
    const Triangle first = mesh.triangles[0];
    const Vector3d on_edge = 0.5 * (mesh.positions[first[0]] + mesh.positions[first[1]]);
    const auto middle = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(on_edge);
    mesh.positions.emplace_back(7, 7, 7);                      // no triangle uses it
    mesh.triangles.push_back({first[0], first[0], first[1]});  // two corners are one
    mesh.triangles.push_back({first[2], first[2], first[2]});  // a point
    mesh.triangles.push_back({first[0], middle, first[1]});    // three points on a line
    mesh.triangles.push_back(first);                           // a copy
    mesh.triangles.push_back({first[1], first[2], first[0]});  // a turned copy
    mesh.triangles.push_back({first[0], first[2], first[1]});  // a copy seen from behind
    return mesh;
}

TriangleMesh inconsistent_orientation() {
    TriangleMesh mesh = icosphere(3);
    for (std::size_t t = 1; t < mesh.triangles.size(); t += 2) flip(mesh.triangles[t]);
    return mesh;
}

TriangleMesh join(const TriangleMesh& a, const TriangleMesh& b) {
    TriangleMesh mesh = a;
    const auto shift = static_cast<Index>(a.positions.size());
    mesh.positions.insert(mesh.positions.end(), b.positions.begin(), b.positions.end());
    for (const auto& [i, j, k] : b.triangles) {
        mesh.triangles.push_back({i + shift, j + shift, k + shift});
    }
    return mesh;
}

TriangleMesh translated(TriangleMesh mesh, const Vector3d& by) {
    for (Vector3d& p : mesh.positions) p += by;
    return mesh;
}

std::optional<std::filesystem::path> models_dir() {
    const char* chosen = std::getenv("ELLICAST_MODELS");
    const std::filesystem::path folder =
        chosen != nullptr && *chosen != '\0'
            ? std::filesystem::path(chosen)
            : std::filesystem::path(ELLICAST_SOURCE_DIR) / ".." / "shared" / "models";
    std::error_code ignored;
    if (!std::filesystem::is_directory(folder, ignored)) return std::nullopt;
    return folder;
}

}  // namespace ellicast::tests
