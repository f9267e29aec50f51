#include "receiver/mesh_regions.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <vector>

#include "receiver/surface_walk.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

// 57 600 faces: some regions.
SurfaceMesh large_ring() {
    return *SurfaceMesh::from(tests::torus(1.0, 0.4, 240, 120));
}

TEST_CASE("regions have each live face once, evenly, and on any number of threads the same ones") {
    SurfaceMesh mesh = large_ring();
    const HalfedgeId h = mesh.outgoing(77);
    REQUIRE(mesh.can_collapse(h));
    mesh.collapse(h);
    const bool shifted = GENERATE(false, true);
    const MeshRegions regions(mesh, shifted, 1);
    REQUIRE(regions.count() == (shifted ? 5 : 4));
    std::vector<int> seen(mesh.face_slots(), 0);
    for (std::size_t region = 0; region < regions.count(); ++region) {
        const auto faces = regions.faces(region);
        CHECK(std::is_sorted(faces.begin(), faces.end()));
        const double whole = static_cast<double>(mesh.face_slots()) / 4.0;
        const bool half = shifted && (region == 0 || region + 1 == regions.count());
        CHECK(static_cast<double>(faces.size()) ==
              Approx(half ? whole / 2.0 : whole).epsilon(0.05));
        for (const FaceId f : faces) {
            ++seen[f];
            REQUIRE(regions.region_of(f) == region);
        }
    }
    for (FaceId f = 0; f < seen.size(); ++f) REQUIRE(seen[f] == (mesh.face_alive(f) ? 1 : 0));
    const MeshRegions other(mesh, shifted, 3);
    for (FaceId f = 0; f < seen.size(); ++f) {
        REQUIRE(other.inner(f) == regions.inner(f));
        if (mesh.face_alive(f)) REQUIRE(other.region_of(f) == regions.region_of(f));
    }
}

TEST_CASE("all faces around an inner face are of its region, and few faces are not inner") {
    const SurfaceMesh mesh = large_ring();
    const MeshRegions regions(mesh, false, 2);
    std::size_t inner = 0;
    for (FaceId f = 0; f < mesh.face_slots(); ++f) {
        bool all_here = true;
        for (const VertexId v : mesh.face(f)) {
            mesh.for_each_outgoing(v, [&](HalfedgeId h) {
                all_here =
                    all_here && regions.region_of(SurfaceMesh::face_of(h)) == regions.region_of(f);
            });
        }
        REQUIRE(regions.inner(f) == all_here);
        inner += all_here ? 1 : 0;
    }
    CHECK(20 * inner > 18 * mesh.face_slots());
}

TEST_CASE("of two partitions, one or the other has nearly every face inside") {
    const SurfaceMesh mesh = large_ring();
    const MeshRegions one(mesh, false, 2);
    const MeshRegions other(mesh, true, 2);
    std::size_t neither = 0;
    for (FaceId f = 0; f < mesh.face_slots(); ++f) {
        neither += one.inner(f) || other.inner(f) ? 0 : 1;
    }
    CHECK(neither == 0);
}

TEST_CASE("work is shared out beside faces") {
    const SurfaceMesh mesh = large_ring();
    std::vector<std::uint32_t> work(mesh.face_slots(), 0);
    double all = 0.0;
    for (FaceId f = 0; f < work.size(); ++f) {
        if (mesh.position(mesh.face(f)[0]).x() > 0.8) work[f] = 50;
        all += 1.0 + work[f];
    }
    const MeshRegions regions(mesh, false, 2, work);
    for (std::size_t region = 0; region < regions.count(); ++region) {
        double sum = 0.0;
        for (const FaceId f : regions.faces(region)) sum += 1.0 + work[f];
        CHECK(sum == Approx(all / static_cast<double>(regions.count())).epsilon(0.05));
    }
}

TEST_CASE("a small mesh is one region without a border, and so are new faces") {
    SurfaceMesh mesh = *SurfaceMesh::from(tests::torus(1.0, 0.4, 30, 20));
    const MeshRegions regions(mesh, GENERATE(false, true), 2);
    REQUIRE(regions.count() == 1);
    REQUIRE(regions.faces(0).size() == mesh.face_slots());
    mesh.split_face(5, mesh.position(mesh.face(5)[0]));
    for (FaceId f = 0; f < mesh.face_slots(); ++f) REQUIRE(regions.inner(f));
}

TEST_CASE("a walk in a region ends where it would without, or at a border") {
    const SurfaceMesh mesh = large_ring();
    const MeshRegions regions(mesh, false, 2);
    std::size_t empty = 0;
    for (FaceId f = 0; f < mesh.face_slots(); f += 7) {
        const FaceId goal = (f + 6) % static_cast<FaceId>(mesh.face_slots());
        const auto [a, b, c] = mesh.face(goal);
        const Eigen::Vector3d x = (mesh.position(a) + mesh.position(b) + mesh.position(c)) / 3.0;
        const auto place = walk_to_closest(mesh, f, x, regions);
        if (!place) {
            ++empty;
            continue;
        }
        REQUIRE(regions.inner(place->face));
        REQUIRE(place->face == walk_to_closest(mesh, f, x).face);
    }
    CHECK(empty > 0);
    CHECK(4 * empty < mesh.face_slots() / 7);
}

}  // namespace
}  // namespace ellicast::receiver
