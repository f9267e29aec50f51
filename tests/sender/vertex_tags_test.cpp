// tests/sender/vertex_tags_test.cpp: what an object's records say beside their positions.
#include "sender/vertex_tags.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "common/octahedral_normal.hpp"
#include "common/ring_tag.hpp"
#include "sender/broadcast_object.hpp"
#include "sender/model_preparation.hpp"
#include "tests/sender/made_objects.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace ellicast::sender;
using Eigen::Vector3d;

namespace {

BroadcastObject object_of(const common::TriangleMesh& mesh, const TagOptions& tags) {
    ObjectOptions options;
    options.name = "made";
    options.tags = tags;
    return make_object(prepare_model(mesh), ShapePromise{}, tests::balls_in(mesh.positions, 20, 1),
                       options);
}

Vector3d position_of(const BroadcastObject& object, std::size_t k) {
    const auto& [x, y, z] = object.vertices[k].position;
    return Vector3d(object.description.origin.data()) + Vector3d(x, y, z);
}

double degrees_between(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

/// Positions as a key: exact, for meshes whose coordinates float32 holds.
using Place = std::array<double, 3>;
Place place(const Vector3d& p) {
    return {p.x(), p.y(), p.z()};
}

common::TriangleMesh rounded(common::TriangleMesh mesh) {
    for (Vector3d& p : mesh.positions) p = p.cast<float>().cast<double>();
    return mesh;
}

/// The tag that each record should have, by sets of the mesh's neighbours.
std::vector<std::uint16_t> expected_rings(const common::TriangleMesh& mesh,
                                          const BroadcastObject& object) {
    std::map<Place, std::uint32_t> index;
    for (std::uint32_t k = 0; k < object.vertices.size(); ++k) {
        index[place(position_of(object, k))] = k;
    }
    std::vector<std::set<std::uint32_t>> neighbours(object.vertices.size());
    for (const common::Triangle& t : mesh.triangles) {
        for (const std::uint32_t a : t) {
            for (const std::uint32_t b : t) {
                const std::uint32_t from = index.at(place(mesh.positions[a]));
                const std::uint32_t to = index.at(place(mesh.positions[b]));
                if (from != to) neighbours[from].insert(to);
            }
        }
    }
    std::vector<std::uint16_t> tags;
    for (const auto& ring : neighbours) {
        unsigned sum = 0;
        for (const std::uint32_t other : ring) sum += common::ring_hash(other);
        tags.push_back(common::ring_tag(ring.size(), sum));
    }
    return tags;
}

}  // namespace

TEST_CASE("a sphere's normals point outward, as exactly as their bits allow") {
    const common::TriangleMesh mesh = tests::icosphere(3);
    for (const int bits : {8, 12, 16}) {
        const BroadcastObject object = object_of(mesh, {.normal_bits = bits});
        CHECK(object.hint.format == protocol::RecordFormat{static_cast<std::uint8_t>(bits)});
        // Where the nearest code is a marked one, the next has to do.
        const double allowed =
            2.0 * common::normal_cell_angle(bits) * 180.0 / std::numbers::pi + 0.5;
        for (std::size_t k = 0; k < object.vertices.size(); ++k) {
            const Vector3d n = common::decode_normal(object.vertices[k].normal, bits);
            REQUIRE(degrees_between(n, position_of(object, k)) < allowed);
        }
    }
}

TEST_CASE("a mesh inside out, or with some faces turned, has the normals of the solid") {
    common::TriangleMesh mesh = tests::icosphere(2);
    // So that no normal lies between two codes, where rounding would decide.
    const Eigen::AngleAxisd turn(1.0, Vector3d(1, 2, 3).normalized());
    for (Vector3d& p : mesh.positions) p = turn * p;
    const BroadcastObject object = object_of(mesh, {.normal_bits = 12});
    const bool all = GENERATE(true, false);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (all || t % 7 == 0) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
    }
    CHECK(object_of(mesh, {.normal_bits = 12}).vertices == object.vertices);
}

TEST_CASE("normals weigh faces by area") {
    // A long prism: at a corner of its square end the two long sides outweigh the end.
    common::TriangleMesh mesh = tests::cube();
    for (Vector3d& p : mesh.positions) p.x() *= 100.0;
    const BroadcastObject object = object_of(mesh, {.normal_bits = 16});
    for (std::size_t k = 0; k < object.vertices.size(); ++k) {
        const Vector3d n = common::decode_normal(object.vertices[k].normal, 16);
        CHECK(std::abs(n.x()) < 0.05);
        CHECK(std::min(std::abs(n.y()), std::abs(n.z())) > 0.4);  // one may have two triangles
    }
}

TEST_CASE("a hole's cap does not bend the normals at its rim") {
    common::TriangleMesh mesh = rounded(tests::icosphere(3));
    std::map<Place, std::uint16_t> whole;
    const BroadcastObject before = object_of(mesh, {.normal_bits = 16});
    for (std::size_t k = 0; k < before.vertices.size(); ++k) {
        whole[place(position_of(before, k))] = before.vertices[k].normal;
    }
    // Without the cap z > 0.9, whose rim then has faces on one side only.
    std::erase_if(mesh.triangles, [&](const common::Triangle& t) {
        return std::ranges::any_of(t, [&](auto v) { return mesh.positions[v].z() > 0.9; });
    });
    const BroadcastObject after = object_of(mesh, {.normal_bits = 16});
    std::size_t same = 0;
    for (std::size_t k = 0; k < after.vertices.size(); ++k) {
        const Vector3d n = common::decode_normal(after.vertices[k].normal, 16);
        CHECK(degrees_between(n, position_of(after, k)) < 8.0);
        same += whole.at(place(position_of(after, k))) == after.vertices[k].normal ? 1 : 0;
    }
    CHECK(same > after.vertices.size() * 8 / 10);
}

TEST_CASE("ring tags are those of the original's edges, in indices of the canonical order") {
    const common::TriangleMesh mesh = rounded(tests::torus(3, 1, 24, 12));
    const BroadcastObject object = object_of(mesh, {.normal_bits = 0, .ring = true});
    const std::vector<std::uint16_t> expected = expected_rings(mesh, object);
    for (std::size_t k = 0; k < object.vertices.size(); ++k) {
        REQUIRE(object.vertices[k].ring == expected[k]);
        CHECK(object.vertices[k].normal == 0);
        CHECK(common::ring_valence(object.vertices[k].ring) == 6);
    }
}

TEST_CASE("vertices at one position are one vertex with the faces and ring of all") {
    const common::TriangleMesh mesh = rounded(tests::icosphere(1));
    common::TriangleMesh torn;  // three vertices a triangle
    for (const common::Triangle& t : mesh.triangles) {
        common::Triangle& own = torn.triangles.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            own[c] = static_cast<std::uint32_t>(torn.positions.size());
            torn.positions.push_back(mesh.positions[t[c]]);
        }
    }
    const TagOptions tags{.normal_bits = 16, .ring = true};
    const BroadcastObject object = object_of(torn, tags);
    REQUIRE(object.vertices.size() == mesh.positions.size());
    const std::vector<std::uint16_t> expected = expected_rings(mesh, object);
    for (std::size_t k = 0; k < object.vertices.size(); ++k) {
        REQUIRE(object.vertices[k].ring == expected[k]);
        const Vector3d n = common::decode_normal(object.vertices[k].normal, 16);
        REQUIRE(degrees_between(n, position_of(object, k)) < 3.0);
    }
}

TEST_CASE("vertices that become one only when rounded are united as well") {
    common::TriangleMesh mesh = tests::icosphere(1);
    for (Vector3d& p : mesh.positions) p += Vector3d(3e5, 0, 0);
    mesh.positions.push_back(mesh.positions[0]);
    mesh.positions.back().x() = std::nextafter(mesh.positions[0].x(), 1e9);
    bool first = true;
    for (common::Triangle& t : mesh.triangles) {
        for (std::uint32_t& v : t) {
            if (v != 0) continue;
            if (!first) v = static_cast<std::uint32_t>(mesh.positions.size() - 1);
            first = false;
        }
    }
    mesh.colours.assign(mesh.positions.size(), {1, 1, 1});
    mesh.colours.back() = {2, 2, 2};
    const BroadcastObject object = object_of(mesh, {.normal_bits = 16, .ring = true});
    CHECK(object.vertices.size() == mesh.positions.size() - 1);
    for (const protocol::VertexRecord& vertex : object.vertices) {
        const unsigned valence = common::ring_valence(vertex.ring);
        CHECK((valence == 5 || valence == 6));
        CHECK(vertex.colour == common::Colour{1, 1, 1});  // the first one's
    }
}

TEST_CASE("colours go with their vertices, and only where there are some and they are wanted") {
    common::TriangleMesh mesh = rounded(tests::icosphere(2));
    CHECK_FALSE(object_of(mesh, {}).hint.format.colour);
    std::map<Place, common::Colour> expected;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        mesh.colours.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v / 2), 9});
        expected[place(mesh.positions[v])] = mesh.colours[v];
    }
    // One that nobody uses stands in front, and a copy of vertex 3 in another colour at the end.
    const auto copy = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(mesh.positions[3]);
    mesh.colours.push_back({77, 77, 77});
    const auto user = std::ranges::find_if(
        mesh.triangles, [](const common::Triangle& t) { return std::ranges::count(t, 3u) > 0; });
    std::ranges::replace(*user, 3u, copy);
    mesh.positions.insert(mesh.positions.begin(), Vector3d(0.5, 0.5, 0.5));
    mesh.colours.insert(mesh.colours.begin(), {99, 99, 99});
    for (common::Triangle& t : mesh.triangles) {
        for (std::uint32_t& v : t) ++v;
    }
    const BroadcastObject object = object_of(mesh, {});
    CHECK((object.hint.format == protocol::RecordFormat{8, false, true}));
    for (std::size_t k = 0; k < object.vertices.size(); ++k) {
        CHECK(object.vertices[k].colour == expected.at(place(position_of(object, k))));
    }
    const BroadcastObject grey = object_of(mesh, {.colour = false});
    CHECK((grey.hint.format == protocol::RecordFormat{8, false, false}));
    CHECK(grey.vertices[0].colour == common::Colour{});
    CHECK(grey.id != object.id);
}

TEST_CASE("tags make another object, in the same order of the same positions") {
    const common::TriangleMesh mesh = tests::torus(3, 1, 24, 12);
    const BroadcastObject plain = object_of(mesh, {.normal_bits = 0});
    CHECK(plain.hint.format == protocol::RecordFormat{});
    std::set<protocol::ObjectId> ids{plain.id};
    for (const int bits : {0, 8, 12, 16}) {
        for (const bool ring : {false, true}) {
            const BroadcastObject object = object_of(mesh, {.normal_bits = bits, .ring = ring});
            ids.insert(object.id);
            for (std::size_t k = 0; k < object.vertices.size(); ++k) {
                REQUIRE(object.vertices[k].position == plain.vertices[k].position);
            }
        }
    }
    CHECK(ids.size() == 8);
}
