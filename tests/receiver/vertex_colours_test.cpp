// tests/receiver/vertex_colours_test.cpp
#include "receiver/vertex_colours.hpp"

#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "common/model_io.hpp"
#include "receiver/output_files.hpp"
#include "tests/support/child_process.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using common::Colour;

namespace {

constexpr Colour kRed{200, 0, 0};
constexpr Colour kBlue{0, 0, 101};
constexpr Colour kGrey{128, 128, 128};

/// Vertex v of the mesh has record 10 v; `received` gives the colours of those that arrived.
struct Scene {
    Scene(common::TriangleMesh mesh,
          const std::vector<std::pair<std::uint32_t, Colour>>& received) {
        reconstruction.vertex_index.assign(mesh.positions.size(), kNotReceived);
        reconstruction.mesh = std::move(mesh);
        object.hint.format.colour = true;
        object.hint.vertices = 10'000;
        for (const auto& [v, colour] : received) {
            reconstruction.vertex_index[v] = 10 * v;
            object.vertex_index.push_back(10 * v);
            object.vertices.push_back({.colour = colour});
        }
    }
    [[nodiscard]] std::vector<Colour> colours() const {
        return vertex_colours(reconstruction, object);
    }
    Reconstruction reconstruction;
    ReceivedObject object;
};

common::TriangleMesh tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
            {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

/// A closed band of triangles about a square prism, four vertices a ring, capped.
common::TriangleMesh prism(std::uint32_t rings) {
    common::TriangleMesh mesh;
    for (std::uint32_t r = 0; r < rings; ++r) {
        for (std::uint32_t k = 0; k < 4; ++k) {
            mesh.positions.emplace_back(k == 0 || k == 3 ? 1 : -1, k < 2 ? 1 : -1, r);
            if (r == 0) continue;
            const std::uint32_t a = 4 * (r - 1) + k;
            const std::uint32_t b = 4 * (r - 1) + (k + 1) % 4;
            mesh.triangles.push_back({a, b, b + 4});
            mesh.triangles.push_back({a, b + 4, a + 4});
        }
    }
    const std::uint32_t top = 4 * (rings - 1);
    mesh.triangles.insert(mesh.triangles.end(), {{0, 2, 1}, {0, 3, 2}});
    mesh.triangles.insert(mesh.triangles.end(), {{top, top + 1, top + 2}, {top, top + 2, top + 3}});
    return mesh;
}

}  // namespace

TEST_CASE("received vertices have the colours that were sent, the others the mean around them") {
    // A tetrahedron: everyone is everyone's neighbour.
    const Scene scene(tetrahedron(), {{0, kRed}, {2, kBlue}, {3, kBlue}});
    const std::vector<Colour> colours = scene.colours();
    CHECK(colours[0] == kRed);
    CHECK(colours[1] == Colour{67, 0, 67});  // 200/3 and 202/3, rounded
    CHECK(colours[2] == kBlue);
    CHECK(colours[3] == kBlue);
}

TEST_CASE("colours reach as far as edges do, the nearest first") {
    std::vector<std::pair<std::uint32_t, Colour>> received;
    for (std::uint32_t k = 0; k < 4; ++k) received.emplace_back(k, kRed);
    for (std::uint32_t k = 0; k < 4; ++k) received.emplace_back(40 + k, kBlue);
    const std::vector<Colour> colours = Scene(prism(11), received).colours();
    for (std::uint32_t k = 0; k < 44; ++k) {
        CAPTURE(k);
        if (k < 20) CHECK(colours[k] == kRed);
        if (k >= 24) CHECK(colours[k] == kBlue);
        if (k >= 20 && k < 24) {
            CHECK((colours[k][0] > 0 && colours[k][2] > 0));  // halfway
        }
    }
}

TEST_CASE("a part without received vertices has the mean of all, and a received grey stays") {
    common::TriangleMesh mesh = tetrahedron();
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    const common::TriangleMesh other = mesh;
    for (const auto& p : other.positions) mesh.positions.emplace_back(p.x() + 9, p.y(), p.z());
    for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    const std::vector<Colour> colours = Scene(mesh, {{0, kGrey}, {1, {0, 0, 0}}}).colours();
    CHECK(colours[0] == kGrey);
    for (std::uint32_t v = n; v < 2 * n; ++v) CHECK(colours[v] == Colour{64, 64, 64});
}

TEST_CASE("nothing received is grey, and an object without colours has none") {
    Scene scene(tetrahedron(), {});
    for (const Colour& colour : scene.colours()) CHECK(colour == kGrey);
    scene.object.hint.format.colour = false;
    CHECK(scene.colours().empty());
}

TEST_CASE("the file has the colours, and no such columns without them") {
    const tests::TemporaryDirectory directory;
    Scene scene(tetrahedron(), {{0, kRed}, {1, kRed}, {2, kBlue}, {3, kBlue}});
    const auto path = directory.path() / "a.ply";
    write_mesh(path, scene.reconstruction, scene.object);
    CHECK(common::read_model(path).colours == std::vector<Colour>{kRed, kRed, kBlue, kBlue});
    scene.object.hint.format.colour = false;
    write_mesh(path, scene.reconstruction, scene.object);
    CHECK(common::read_model(path).colours.empty());
}
