#include "receiver/surface_walk.hpp"

#include <catch2/catch.hpp>
#include <optional>

#include "common/random.hpp"
#include "common/triangle_tree.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

TEST_CASE("from the near side of a sphere, a walk ends where a search of all faces does") {
    const common::TriangleMesh mesh = tests::icosphere(3);
    const std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    REQUIRE(surface);
    const common::TriangleTree tree(mesh);
    common::Random random(3);
    for (int n = 0; n < 2'000; ++n) {
        const Vector3d direction(random.uniform() - 0.5, random.uniform() - 0.5,
                                 random.uniform() - 0.5);
        const Vector3d x = (1.01 + 0.4 * random.uniform()) * direction.normalized();
        FaceId start = 0;
        do {
            start = static_cast<FaceId>(random.below(surface->face_slots()));
        } while (surface->position(surface->face(start)[0]).dot(x) < 0.3);
        const SurfacePlace place = walk_to_closest(*surface, start, x);
        const common::TriangleTree::Hit hit = tree.closest(x);
        REQUIRE(place.squared_distance == Approx(hit.squared_distance).epsilon(1e-9));
        REQUIRE((place.point - hit.point).norm() < 1e-9);
    }
}

TEST_CASE("a walk that starts at its goal stays there") {
    const common::TriangleMesh mesh = tests::cube();
    const std::optional<SurfaceMesh> surface = SurfaceMesh::from(mesh);
    REQUIRE(surface);
    for (FaceId f = 0; f < surface->face_slots(); ++f) {
        const auto [a, b, c] = surface->face(f);
        const Vector3d x =
            (surface->position(a) + surface->position(b) + surface->position(c)) / 3.0;
        const SurfacePlace place = walk_to_closest(*surface, f, 1.1 * x);
        REQUIRE(place.face == f);
        REQUIRE(place.barycentric.minCoeff() > 0.2);
    }
}

}  // namespace
}  // namespace ellicast::receiver
