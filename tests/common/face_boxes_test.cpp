// tests/common/face_boxes_test.cpp
#include "common/face_boxes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "common/random.hpp"

using namespace ellicast::common;
using Eigen::Vector3d;

namespace {

using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

Vector3d random_point(Random& random) {
    return {random.uniform(), random.uniform(), random.uniform()};
}

// Triangles of all sizes anywhere, some of them points.
TriangleMesh random_soup(Random& random, std::uint32_t triangles) {
    TriangleMesh mesh;
    for (std::uint32_t t = 0; t < triangles; ++t) {
        const Vector3d at = random_point(random);
        const double size = random.uniform() * random.uniform() * random.uniform();
        for (int c = 0; c < 3; ++c) mesh.positions.push_back(at + size * random_point(random));
        mesh.triangles.push_back({3 * t, 3 * t + 1, t % 7 == 0 ? 3 * t : 3 * t + 2});
    }
    return mesh;
}

Pairs meeting_by_definition(const TriangleMesh& mesh) {
    std::vector<Eigen::AlignedBox3d> boxes(mesh.triangles.size());
    for (std::size_t t = 0; t < boxes.size(); ++t) {
        for (const std::uint32_t v : mesh.triangles[t]) boxes[t].extend(mesh.positions[v]);
    }
    Pairs pairs;
    for (std::uint32_t f = 0; f < boxes.size(); ++f) {
        for (std::uint32_t g = f + 1; g < boxes.size(); ++g) {
            if (boxes[f].intersects(boxes[g])) pairs.insert({f, g});
        }
    }
    return pairs;
}

Pairs found_from_one_side(const FaceBoxes& boxes, std::uint32_t faces) {
    Pairs pairs;
    for (std::uint32_t f = 0; f < faces; ++f) {
        boxes.for_each_later(f, [&](std::uint32_t g) {
            REQUIRE(f != g);
            REQUIRE(pairs.insert(std::minmax(f, g)).second);
        });
    }
    return pairs;
}

void require_all_found(const TriangleMesh& mesh, const FaceBoxes& boxes) {
    const auto faces = static_cast<std::uint32_t>(mesh.triangles.size());
    const Pairs expected = meeting_by_definition(mesh);
    const Pairs found = found_from_one_side(boxes, faces);
    // Rounded boxes may meet where exact ones just don't, and only there.
    REQUIRE(std::includes(found.begin(), found.end(), expected.begin(), expected.end()));
    REQUIRE(found.size() <= expected.size() + 2);
    std::size_t from_both = 0;
    for (std::uint32_t f = 0; f < faces; ++f) {
        boxes.for_each_meeting(f, [&](std::uint32_t) { ++from_both; });
    }
    REQUIRE(from_both == 2 * found.size());
}

TEST_CASE("boxes that meet are found, each pair once or from both of its faces") {
    for (const std::uint32_t faces : {0u, 1u, 2u, 3u, 4u, 5u, 17u, 300u}) {
        CAPTURE(faces);
        Random random(faces + 1);
        const TriangleMesh mesh = random_soup(random, faces);
        require_all_found(mesh, FaceBoxes(mesh));
    }
}

TEST_CASE("after a move boxes are found where they are now") {
    Random random(3);
    TriangleMesh mesh = random_soup(random, 200);
    FaceBoxes boxes(mesh);
    for (Vector3d& p : mesh.positions) p += 0.3 * random_point(random);
    boxes.refit(mesh);
    require_all_found(mesh, boxes);
}

TEST_CASE("every face has one place along the curve") {
    Random random(4);
    const TriangleMesh mesh = random_soup(random, 50);
    const FaceBoxes boxes(mesh);
    std::vector<int> seen(50, 0);
    boxes.for_each_slot(0, 20, [&](std::uint32_t f) { ++seen[f]; });
    boxes.for_each_slot(20, 50, [&](std::uint32_t f) { ++seen[f]; });
    REQUIRE(std::count(seen.begin(), seen.end(), 1) == 50);
}

}  // namespace
