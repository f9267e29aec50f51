// tests/common/solid_voxels_test.cpp
#include "common/solid_voxels.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "common/mesh_topology.hpp"
#include "common/random.hpp"
#include "common/triangle_tree.hpp"
#include "tests/support/meshes.hpp"

namespace {

using namespace ellicast::common;
using namespace ellicast::tests;
using Eigen::Vector3d;

std::size_t count_inside(const TriangleMesh& mesh, const GridFrame& frame) {
    const auto nodes = voxelise_solid(mesh, frame);
    return static_cast<std::size_t>(std::count(nodes.begin(), nodes.end(), std::uint8_t{1}));
}

double voxel_volume(const TriangleMesh& mesh, int cells) {
    const GridFrame frame = make_grid_frame(surface_box(mesh), cells, 1);
    return static_cast<double>(count_inside(mesh, frame)) * std::pow(frame.spacing, 3);
}

// Winding number by solid angles ([vOS83]), independent of any rows. x must not lie on the surface.
double winding_number(const TriangleMesh& mesh, const Vector3d& x) {
    double sum = 0.0;
    for (const auto& [i, j, k] : mesh.triangles) {
        const Vector3d a = mesh.positions[i] - x;
        const Vector3d b = mesh.positions[j] - x;
        const Vector3d c = mesh.positions[k] - x;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += 2.0 * std::atan2(a.dot(b.cross(c)),
                                la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (4.0 * std::numbers::pi);
}

// Every node is as its winding number says, except within `slack` of the surface.
void require_exact(const TriangleMesh& mesh, const GridFrame& frame, double slack) {
    const auto nodes = voxelise_solid(mesh, frame);
    const TriangleTree tree(mesh);
    for (int k = 0; k < frame.dims[2]; ++k) {
        for (int j = 0; j < frame.dims[1]; ++j) {
            for (int i = 0; i < frame.dims[0]; ++i) {
                const Vector3d x = frame.position(i, j, k);
                if (tree.closest(x, slack * slack).squared_distance <= slack * slack) continue;
                const bool inside = std::abs(winding_number(mesh, x)) > 0.5;
                CAPTURE(i, j, k);
                REQUIRE((nodes[frame.index(i, j, k)] == 1) == inside);
            }
        }
    }
}

GridFrame integer_grid(int n, const Vector3d& origin) {
    GridFrame frame;
    frame.origin = origin;
    frame.spacing = 1.0;
    frame.dims = {n, n, n};
    return frame;
}

// Turns y to x, z to y, x to z.
TriangleMesh axes_turned(TriangleMesh mesh) {
    for (Vector3d& p : mesh.positions) p = Vector3d(p[1], p[2], p[0]);
    return mesh;
}

}  // namespace

TEST_CASE("a grid frame covers its box with the cells asked for") {
    const Eigen::AlignedBox3d box(Vector3d(-1, 2, 3), Vector3d(4, 3, 5.5));
    const GridFrame frame = make_grid_frame(box, 10, 3);
    CHECK(frame.spacing == 0.5);
    CHECK(frame.dims == std::array<int, 3>{10 + 6 + 1, 2 + 6 + 1, 5 + 6 + 1});
    CHECK(frame.position(3, 3, 3) == box.min());
    CHECK(frame.position(13, 5, 8) == box.max());
    CHECK(frame.size() == 17u * 9u * 12u);
    // A flat box still has cells on every axis, and equal sides equal counts whatever rounding
    // does.
    const Eigen::AlignedBox3d flat(Vector3d(0, 0, 1), Vector3d(1, 0.3, 1));
    CHECK(make_grid_frame(flat, 3, 0).dims == std::array<int, 3>{4, 2, 2});
    for (int cells = 1; cells < 300; ++cells) {
        const Eigen::AlignedBox3d cubic(Vector3d(0.1, 0.7, -0.3), Vector3d(0.4, 1.0, 0.0));
        const GridFrame f = make_grid_frame(cubic, cells, 0);
        REQUIRE(f.dims == std::array<int, 3>{cells + 1, cells + 1, cells + 1});
    }
}

TEST_CASE("a cube on the grid's own lattice has exactly as many nodes as cells") {
    for (const int side : {1, 2, 5}) {
        for (const int pieces : {1, side}) {
            const TriangleMesh mesh = translated(box(Vector3d::Constant(side), pieces),
                                                 Vector3d::Constant(0.5 * side + 1));
            const GridFrame frame = integer_grid(8, Vector3d::Zero());
            const auto nodes = voxelise_solid(mesh, frame);
            for (int k = 0; k < 8; ++k) {
                for (int j = 0; j < 8; ++j) {
                    for (int i = 0; i < 8; ++i) {
                        const bool inside = std::min({i, j, k}) >= 1 && std::max({i, j, k}) <= side;
                        REQUIRE((nodes[frame.index(i, j, k)] == 1) == inside);
                    }
                }
            }
        }
    }
}

TEST_CASE("rows through vertices and edges lose and double nothing") {
    // All edges and vertices of these lie on rows of the lattice, diagonals of squares included.
    const GridFrame frame = integer_grid(20, Vector3d(-6, -6, -6));
    TriangleMesh octahedron;
    octahedron.positions = {{5, 0, 0}, {-5, 0, 0}, {0, 5, 0}, {0, -5, 0}, {0, 0, 5}, {0, 0, -5}};
    octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                            {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    require_exact(octahedron, frame, 1e-9);
    TriangleMesh plate = double_torus(1);
    for (Vector3d& p : plate.positions) p = (2.0 * p).eval();
    require_exact(plate, frame, 1e-9);
    CHECK(count_inside(plate, frame) == 13 * 8);
    CHECK(count_inside(axes_turned(plate), frame) == 13 * 8);
    CHECK(count_inside(axes_turned(axes_turned(plate)), frame) == 13 * 8);
    // Random closed lattice shapes: unions of unit cells are counted exactly.
    const TriangleMesh two = edge_shared_by_four();
    CHECK(count_inside(two, frame) == 2);
    CHECK(count_inside(axes_turned(two), frame) == 2);
    CHECK(count_inside(vertex_shared_by_two(), frame) == 2);
}

TEST_CASE("solids on the lattice, moved by all sorts of steps, always fill whole rows") {
    const std::uint64_t seed = GENERATE(range(1, 9));
    CAPTURE(seed);
    Random random(seed);
    // Vertices snapped to a coarse lattice: many vertices, edges and faces exactly on rows. A
    // streak would reach the end of its row.
    TriangleMesh mesh = icosphere(2, 6.0);
    for (Vector3d& p : mesh.positions) {
        p += Vector3d(random.uniform(), random.uniform(), random.uniform());
        p = (2.0 * p).array().round() / 2.0;
    }
    const GridFrame frame =
        integer_grid(18, Vector3d::Constant(-8.5 + (seed % 2 == 0 ? 0.0 : 0.5)));
    const auto nodes = voxelise_solid(mesh, frame);
    for (int k = 0; k < 18; ++k) {
        for (int j = 0; j < 18; ++j) REQUIRE(nodes[frame.index(17, j, k)] == 0);
    }
    require_exact(mesh, frame, 1e-9);
}

TEST_CASE("nodes agree with the winding number by solid angles") {
    require_exact(icosphere(3), make_grid_frame(surface_box(icosphere(3)), 10, 1), 1e-9);
    const TriangleMesh ring = torus(1.0, 0.4, 24, 12);
    require_exact(ring, make_grid_frame(surface_box(ring), 16, 1), 1e-9);
    const TriangleMesh shells = nested_shells();
    require_exact(shells, make_grid_frame(surface_box(shells), 9, 1), 1e-9);
    // The winding number is 2 where the parts overlap, and that is inside.
    const TriangleMesh overlapping = overlapping_parts();
    require_exact(overlapping, make_grid_frame(surface_box(overlapping), 10, 1), 1e-9);
    // Seen from within, the number is -1: inside as well.
    TriangleMesh inside_out = icosphere(2);
    for (Triangle& t : inside_out.triangles) std::swap(t[0], t[1]);
    require_exact(inside_out, make_grid_frame(surface_box(inside_out), 10, 1), 1e-9);
}

TEST_CASE("the voxel volume is the solid's within the error of the grid") {
    CHECK(voxel_volume(icosphere(4), 100) == Approx(signed_volume(icosphere(4))).epsilon(2e-3));
    const TriangleMesh ring = torus(1.0, 0.3, 60, 30);
    CHECK(voxel_volume(ring, 100) == Approx(signed_volume(ring)).epsilon(5e-3));
    CHECK(voxel_volume(nested_shells(), 100) ==
          Approx(signed_volume(nested_shells())).epsilon(5e-3));
}

TEST_CASE("only what lies within the grid matters, and a solid may stick out of it") {
    const TriangleMesh mesh = icosphere(3, 10.0);
    const GridFrame frame = integer_grid(5, Vector3d(-2, -2, -2));
    CHECK(count_inside(mesh, frame) == 125);
    CHECK(count_inside(translated(mesh, Vector3d(100, 0, 0)), frame) == 0);
    CHECK(count_inside(translated(mesh, Vector3d(-100, 0, 0)), frame) == 0);
    require_exact(translated(mesh, Vector3d(9, 3, 1)), frame, 1e-9);
    GridFrame none;
    CHECK(voxelise_solid(mesh, none).empty());
    CHECK(count_inside(TriangleMesh{}, frame) == 0);
}

TEST_CASE("threads do not change a node") {
    const TriangleMesh mesh = torus(1.0, 0.4, 40, 20);
    const GridFrame frame = make_grid_frame(surface_box(mesh), 41, 2);
    const auto one = voxelise_solid(mesh, frame, 1);
    for (const unsigned threads : {0u, 2u, 3u, 8u, 1000u}) {
        CHECK(voxelise_solid(mesh, frame, threads) == one);
    }
}

TEST_CASE("shifted cubes overlap by the value of the textbook") {
    // Shifted by a quarter of the side along x: 0.75 / 1.25. 50 cells put every face between nodes.
    const TriangleMesh a = cube(1.0);
    CHECK(volume_overlap(a, translated(a, Vector3d(0.25, 0, 0)), 50) == 0.75 / 1.25);
    CHECK(volume_overlap(a, translated(a, Vector3d(0, 0.25, 0)), 50) == 0.75 / 1.25);
    CHECK(volume_overlap(a, translated(a, Vector3d(0, 0, 0.25)), 50) == 0.75 / 1.25);
    const double both = 0.75 * 0.75 * 0.75;
    CHECK(volume_overlap(a, translated(a, Vector3d(0.25, 0.25, -0.25)), 50) ==
          Approx(both / (2.0 - both)).epsilon(1e-12));
    CHECK(volume_overlap(a, cube(0.5), 40) == 0.125);
    CHECK(volume_overlap(a, a) == 1.0);
    CHECK(volume_overlap(a, translated(a, Vector3d(5, 0, 0))) == 0.0);
}

TEST_CASE("the overlap of spheres is the lens of the textbook") {
    // Radius 1, centres d apart: lens pi (4 + d) (2 - d)^2 / 12.
    const double d = 0.5;
    const double lens = std::numbers::pi * (4.0 + d) * (2.0 - d) * (2.0 - d) / 12.0;
    const double expected = lens / (8.0 / 3.0 * std::numbers::pi - lens);
    const TriangleMesh a = icosphere(4);
    CHECK(volume_overlap(a, translated(a, Vector3d(0.3, 0, 0.4)), 128) ==
          Approx(expected).epsilon(5e-3));
}

TEST_CASE("nothing overlaps nothing fully, and something not at all") {
    CHECK(volume_overlap(TriangleMesh{}, TriangleMesh{}) == 1.0);
    CHECK(volume_overlap(TriangleMesh{}, cube(), 20) == 0.0);
    TriangleMesh point;
    point.positions = {{1, 1, 1}};
    point.triangles = {{0, 0, 0}};
    CHECK(volume_overlap(point, point) == 1.0);
    // A vertex without triangles, however far away, does not coarsen the grid.
    TriangleMesh stray = cube();
    stray.positions.emplace_back(1e6, 0, 0);
    CHECK(volume_overlap(stray, cube(0.5), 40) == 0.125);
}
