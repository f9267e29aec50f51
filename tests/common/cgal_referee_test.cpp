// tests/common/cgal_referee_test.cpp: CGAL as the referee of what we measure.
#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/random.hpp"
#include "common/self_intersection.hpp"
#include "common/triangle_intersection.hpp"
#include "common/triangle_tree.hpp"
#include "tests/support/meshes.hpp"

namespace {

using namespace ellicast::common;
using namespace ellicast::tests;
using Eigen::Vector3d;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Primitive = CGAL::AABB_face_graph_triangle_primitive<SurfaceMesh>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
using FacePair = std::pair<std::size_t, std::size_t>;

Kernel::Point_3 cgal_point(const Vector3d& p) {
    return {p[0], p[1], p[2]};
}

// Faces keep their indices. Requires a manifold.
SurfaceMesh cgal_mesh(const TriangleMesh& mesh) {
    using Vertex = SurfaceMesh::Vertex_index;
    SurfaceMesh result;
    for (const Vector3d& p : mesh.positions) result.add_vertex(cgal_point(p));
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto face = result.add_face(Vertex(a), Vertex(b), Vertex(c));
        if (face == SurfaceMesh::null_face()) FAIL("a face that makes the mesh non-manifold");
    }
    return result;
}

Tree cgal_tree(const SurfaceMesh& mesh) {
    return {faces(mesh).first, faces(mesh).second, mesh};
}

void check_distances(const TriangleMesh& mesh, std::uint64_t seed) {
    CAPTURE(seed);
    const SurfaceMesh referee_mesh = cgal_mesh(mesh);
    const Tree referee = cgal_tree(referee_mesh);
    const TriangleTree tree(mesh);
    const Eigen::AlignedBox3d box = surface_box(mesh);
    const double diagonal = box.diagonal().norm();
    Random random(seed);
    double worst = 0.0;
    for (int q = 0; q < 1'000; ++q) {
        const double spread = q % 2 == 0 ? 0.6 : 3.0;
        Vector3d x = box.center();
        for (int axis = 0; axis < 3; ++axis)
            x[axis] += spread * diagonal * (random.uniform() - 0.5);
        const double ours = std::sqrt(tree.closest(x).squared_distance);
        const double theirs = std::sqrt(referee.squared_distance(cgal_point(x)));
        worst = std::max(worst, std::abs(ours - theirs) - 1e-9 * theirs);
    }
    CHECK(worst <= 1e-15 * diagonal);
}

// rms from samples of `from` to `to`, both kept by the referee.
double referee_rms(const TriangleMesh& from, const TriangleMesh& to, std::size_t samples,
                   std::uint64_t seed) {
    const SurfaceMesh referee_mesh = cgal_mesh(to);
    const Tree referee = cgal_tree(referee_mesh);
    double sum = 0.0;
    for (const SurfaceSample& s : sample_surface(from, samples, seed)) {
        sum += referee.squared_distance(cgal_point(s.point));
    }
    return std::sqrt(sum / static_cast<double>(samples));
}

void check_rms(const TriangleMesh& mesh, const TriangleMesh& reference, std::size_t samples) {
    const double diagonal = surface_box(reference).diagonal().norm();
    const MeshDistance d = measure_distance(mesh, reference, {.samples = samples, .seed = 5});
    const double to = referee_rms(mesh, reference, samples, 5) / diagonal;
    const double from = referee_rms(reference, mesh, samples, 5) / diagonal;
    CHECK(d.rms_to_reference == Approx(to).epsilon(1e-12));
    CHECK(d.rms_from_reference == Approx(from).epsilon(1e-12));
}

std::set<FacePair> all_referee_pairs(const TriangleMesh& mesh) {
    const SurfaceMesh referee_mesh = cgal_mesh(mesh);
    std::vector<std::pair<SurfaceMesh::Face_index, SurfaceMesh::Face_index>> found;
    CGAL::Polygon_mesh_processing::self_intersections(referee_mesh, std::back_inserter(found));
    std::set<FacePair> pairs;
    for (const auto& [f, g] : found) pairs.insert(std::minmax<std::size_t>(f.idx(), g.idx()));
    return pairs;
}

// Without those that share a vertex: the referee counts them where they overlap otherwise, we do
// not.
std::set<FacePair> referee_pairs(const TriangleMesh& mesh) {
    std::set<FacePair> pairs = all_referee_pairs(mesh);
    std::erase_if(pairs, [&](const FacePair& pair) {
        const Triangle& s = mesh.triangles[pair.first];
        const Triangle& t = mesh.triangles[pair.second];
        return std::find_first_of(s.begin(), s.end(), t.begin(), t.end()) != s.end();
    });
    return pairs;
}

void check_self_intersections(const TriangleMesh& mesh, std::size_t at_least) {
    const std::set<FacePair> expected = referee_pairs(mesh);
    std::set<std::size_t> expected_faces;
    for (const auto& [f, g] : expected) expected_faces.insert({f, g});
    const SelfIntersections found = count_self_intersections(mesh);
    CHECK(found.pairs == expected.size());
    CHECK(found.faces == expected_faces.size());
    CHECK(found.pairs >= at_least);
}

TriangleMesh crumpled(const TriangleMesh& mesh, double by, std::uint64_t seed) {
    Random random(seed);
    TriangleMesh result = mesh;
    for (Vector3d& p : result.positions) {
        for (int axis = 0; axis < 3; ++axis) p[axis] += by * (random.uniform() - 0.5);
    }
    return result;
}

}  // namespace

TEST_CASE("closest distances are CGAL's") {
    check_distances(icosphere(4), 1);
    check_distances(torus(1, 0.3, 60, 20), 2);
    check_distances(double_torus(3), 3);
    check_distances(crumpled(icosphere(4), 0.5, 7), 4);
    TriangleMesh thin = crumpled(icosphere(3), 0.1, 8);
    for (Vector3d& p : thin.positions) p[2] *= 1e-5;
    check_distances(thin, 5);
}

TEST_CASE("root-mean-square distances are CGAL's on the same samples") {
    check_rms(icosphere(3), torus(0.8, 0.3, 40, 20), 3'000);
    check_rms(crumpled(icosphere(4), 0.02, 1), icosphere(4), 3'000);
    check_rms(translated(double_torus(2), Vector3d(0.1, 0.2, 0.3)), double_torus(3), 3'000);
}

TEST_CASE("self-intersections are CGAL's on made meshes") {
    check_self_intersections(icosphere(3), 0);
    check_self_intersections(overlapping_parts(), 50);
    check_self_intersections(crumpled(icosphere(3), 0.6, 3), 100);
    check_self_intersections(crumpled(torus(1, 0.3, 40, 20), 0.3, 4), 100);
    // Overlaps in one plane and touches along edges, on a lattice.
    check_self_intersections(join(box({1, 1, 1}, 4), translated(box({1, 1, 1}, 3), {1, 0, 0})), 50);
    check_self_intersections(join(double_torus(1), translated(double_torus(1), {0.5, 0.5, 0})), 50);
    check_self_intersections(join(cube(), translated(cube(), {1, 1, 1})), 1);
}

TEST_CASE("scans measure as CGAL says, also where horse runs into itself") {
    const auto folder = models_dir();
    if (!folder) {
        WARN("skipped: the reference models are not there");
        return;
    }
    const TriangleMesh horse = read_model(*folder / "horse.ply");
    check_distances(read_model(*folder / "spot.ply"), 6);
    check_self_intersections(horse, 2);
    CHECK(all_referee_pairs(horse).size() == 4);  // the other two pairs share a vertex
    const TriangleMesh fertility = read_model(*folder / "fertility.ply");
    check_distances(fertility, 7);
    const double diagonal = surface_box(fertility).diagonal().norm();
    check_rms(crumpled(fertility, 0.005 * diagonal, 2), fertility, 5'000);
    check_self_intersections(crumpled(fertility, 0.02 * diagonal, 3), 100);
}
