// tests/receiver/reconstruction_test.cpp
#include "receiver/reconstruction.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <utility>

#include "common/mesh_distance.hpp"
#include "common/random.hpp"
#include "sender/broadcast_object.hpp"
#include "sender/decomposition.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::receiver {
namespace {

using Eigen::Vector3d;

sender::BroadcastObject object_of(const common::TriangleMesh& mesh, std::size_t ellipsoids = 120) {
    const sender::PreparedModel model = sender::prepare_model(mesh);
    sender::DecompositionOptions options;
    options.ellipsoids = ellipsoids;
    options.candidates = 600;
    options.refine = 0;  // takes longer than all the rest
    return sender::make_object(model, sender::promise_topology(model),
                               sender::decompose(model.solid, options), {"made", 1});
}

// What is left of an object when each record is lost with the given probability.
ReceivedObject received(const sender::BroadcastObject& object, double ellipsoid_loss,
                        double vertex_loss, std::uint64_t seed) {
    common::Random random(seed);
    ReceivedObject result;
    result.id = object.id;
    result.hint = object.hint;
    result.description = object.description;
    for (std::uint32_t i = 0; i < object.ellipsoids.size(); ++i) {
        if (random.chance(ellipsoid_loss)) continue;
        result.ellipsoid_index.push_back(i);
        result.ellipsoids.push_back(object.ellipsoids[i]);
    }
    for (std::uint32_t i = 0; i < object.vertices.size(); ++i) {
        if (random.chance(vertex_loss)) continue;
        result.vertex_index.push_back(i);
        result.vertices.push_back(object.vertices[i]);
    }
    return result;
}

using Bits = std::array<float, 3>;

// Every received vertex is in the mesh bit for bit, or is listed.
void require_positions_kept(const ReceivedObject& object, const Reconstruction& result) {
    std::set<Bits> in_mesh;
    REQUIRE(result.vertex_index.size() == result.mesh.positions.size());
    for (std::size_t i = 0; i < result.mesh.positions.size(); ++i) {
        if (result.vertex_index[i] == kNotReceived) continue;
        const Vector3d& p = result.mesh.positions[i];
        REQUIRE(in_mesh
                    .insert({static_cast<float>(p.x()), static_cast<float>(p.y()),
                             static_cast<float>(p.z())})
                    .second);
    }
    std::size_t missing = 0;
    for (const protocol::VertexRecord& v : object.vertices)
        missing += 1 - in_mesh.count(v.position);
    REQUIRE(missing == result.not_inserted.size());
}

TEST_CASE(
    "with nothing lost every vertex is there, no other is, and the surface is the original's") {
    const common::TriangleMesh original = tests::torus(1, 0.4, 60, 30);
    const sender::BroadcastObject object = object_of(original);
    const ReceivedObject all = received(object, 0, 0, 1);
    const std::optional<Reconstruction> result = reconstruct(all);
    REQUIRE(result);
    REQUIRE(result->topology_as_promised);
    REQUIRE(result->topology.genus() == 1);
    REQUIRE(result->not_inserted.empty());
    REQUIRE(result->mesh.positions.size() == original.positions.size());
    require_positions_kept(all, *result);
    REQUIRE(common::measure_distance(result->mesh, original).rms() < 1e-3);
}

TEST_CASE("any subset gives a closed manifold with every received vertex in its place") {
    const sender::BroadcastObject object = object_of(tests::torus(1, 0.4, 40, 20));
    for (std::uint64_t seed = 1; seed <= 24; ++seed) {
        INFO("seed " << seed);
        common::Random random(seed);
        const double ellipsoid_loss = random.uniform();
        const double vertex_loss = seed % 4 == 0 ? 1.0 : random.uniform();
        const ReceivedObject part = received(object, ellipsoid_loss, vertex_loss, seed);
        if (part.ellipsoids.empty()) continue;
        const std::optional<Reconstruction> result = reconstruct(part, {.grid = 48});
        REQUIRE(result);
        REQUIRE(result->topology.closed);
        REQUIRE(result->topology.manifold);
        require_positions_kept(part, *result);
    }
}

TEST_CASE("nothing at all, or vertices alone, give no mesh") {
    const sender::BroadcastObject object = object_of(tests::icosphere(2));
    REQUIRE_FALSE(reconstruct(received(object, 1, 1, 1)));
    REQUIRE_FALSE(reconstruct(received(object, 1, 0, 1)));
}

TEST_CASE("ellipsoids alone give the marching-cubes mesh") {
    const common::TriangleMesh original = tests::icosphere(3);
    const std::optional<Reconstruction> result =
        reconstruct(received(object_of(original), 0, 1, 1));
    REQUIRE(result);
    REQUIRE(result->topology_as_promised);
    for (const std::uint32_t index : result->vertex_index) REQUIRE(index == kNotReceived);
    REQUIRE(common::measure_distance(result->mesh, original).rms() < 0.01);
}

TEST_CASE("threads, stages and a missing description change no bit of the mesh") {
    const sender::BroadcastObject object = object_of(tests::torus(1, 0.4, 40, 20));
    ReceivedObject part = received(object, 0.1, 0.4, 5);
    const std::optional<Reconstruction> one = reconstruct(part, {.threads = 1});
    const std::optional<Reconstruction> many =
        reconstruct(part, {.threads = 6, .keep_stages = true});
    part.description.reset();
    const std::optional<Reconstruction> nameless = reconstruct(part, {.threads = 2});
    REQUIRE(one);
    REQUIRE(many);
    REQUIRE(nameless);
    for (const auto* other : {&*many, &*nameless}) {
        REQUIRE(one->mesh.positions == other->mesh.positions);
        REQUIRE(one->mesh.triangles == other->mesh.triangles);
        REQUIRE(one->vertex_index == other->vertex_index);
        REQUIRE(one->provenance == other->provenance);
        REQUIRE(one->confidence.distance == other->confidence.distance);
        REQUIRE(one->confidence.completeness == other->confidence.completeness);
    }
    REQUIRE_FALSE(one->stages);
    REQUIRE(many->stages);
    REQUIRE(common::analyse_topology(many->stages->marching_cubes).manifold);
    REQUIRE(common::analyse_topology(many->stages->halfway).manifold);
    REQUIRE(common::analyse_topology(many->stages->ellipsoids).components ==
            part.ellipsoids.size());
}

TEST_CASE("every vertex says whether it was received, guessed or coarse") {
    const sender::BroadcastObject object = object_of(tests::torus(1, 0.4, 60, 30));
    const double loss = GENERATE(0.0, 0.4, 0.97, 1.0);
    const bool conceal = GENERATE(true, false);
    CAPTURE(loss, conceal);
    const ReceivedObject part = received(object, 0, loss, 3);
    const std::optional<Reconstruction> result = reconstruct(part, {.conceal = conceal});
    REQUIRE(result);
    const std::size_t n = result->mesh.positions.size();
    REQUIRE(result->provenance.size() == n);
    REQUIRE(result->confidence.distance.size() == n);
    REQUIRE(result->confidence.completeness.size() == n);
    std::array<std::size_t, 3> count{};
    for (std::size_t v = 0; v < n; ++v) {
        const Provenance provenance = result->provenance[v];
        ++count[static_cast<std::size_t>(provenance)];
        REQUIRE((provenance == Provenance::received) == (result->vertex_index[v] != kNotReceived));
        REQUIRE((provenance == Provenance::received) == (result->confidence.distance[v] == 0.0F));
    }
    CHECK(count[0] == part.vertices.size() - result->not_inserted.size());
    CHECK((count[1] > 0) == (conceal && loss > 0.0 && loss < 1.0));
    if (loss == 0.0) CHECK(count[2] == 0);
    if (loss > 0.9) CHECK(count[2] > 0);
    CHECK(result->summary.missing == object.vertices.size() - part.vertices.size());
    CHECK(result->summary.largest_gap.has_value() == (loss > 0.0));
}

TEST_CASE("where no vertex came, ellipsoids say what the surface is") {
    const common::TriangleMesh original = tests::torus(1, 0.4, 60, 30);
    const sender::BroadcastObject object = object_of(original);
    ReceivedObject part = received(object, 0, 1, 1);
    for (std::uint32_t i = 0; i < object.vertices.size(); ++i) {
        const auto& [x, y, z] = object.vertices[i].position;
        const Vector3d p = Vector3d(object.description.origin[0], object.description.origin[1],
                                    object.description.origin[2]) +
                           Vector3d(x, y, z);
        if (std::abs(std::atan2(p.y(), p.x())) < 0.5) continue;  // a sixth of the ring
        part.vertex_index.push_back(i);
        part.vertices.push_back(object.vertices[i]);
    }
    const std::optional<Reconstruction> result = reconstruct(part);
    REQUIRE(result);
    REQUIRE(result->topology_as_promised);
    require_positions_kept(part, *result);
    CHECK(common::measure_distance(result->mesh, original).rms() < 2e-3);
}

TEST_CASE("with nothing missing, concealment changes no bit") {
    const sender::BroadcastObject object = object_of(tests::torus(1, 0.4, 40, 20));
    const ReceivedObject all = received(object, 0.2, 0, 1);
    const std::optional<Reconstruction> on = reconstruct(all);
    const std::optional<Reconstruction> off = reconstruct(all, {.conceal = false});
    REQUIRE(on);
    REQUIRE(off);
    CHECK(on->mesh.positions == off->mesh.positions);
    CHECK(on->mesh.triangles == off->mesh.triangles);
}

TEST_CASE("a model far from the origin comes back bit for bit") {
    // At 4000, neighbouring float32 lie 2^-12 apart: finer coordinates need an origin.
    const auto [steps, needs_origin] = GENERATE(std::pair(4096.0, false), std::pair(65536.0, true));
    common::TriangleMesh mesh = tests::icosphere(3, 2.0);
    for (Vector3d& p : mesh.positions) {
        for (double& x : p) x = std::round(x * steps) / steps;
        p += Vector3d(4000, -700, 12);
    }
    const sender::BroadcastObject object = object_of(mesh);
    REQUIRE((object.description.origin[0] != 0.0) == needs_origin);
    const std::optional<Reconstruction> result = reconstruct(received(object, 0, 0, 1));
    REQUIRE(result);
    std::set<std::array<double, 3>> original;
    for (const Vector3d& p : mesh.positions) original.insert({p.x(), p.y(), p.z()});
    REQUIRE(result->mesh.positions.size() == original.size());
    for (const Vector3d& p : result->mesh.positions) {
        REQUIRE(original.count({p.x(), p.y(), p.z()}) == 1);
    }
}

TEST_CASE("scale and place of a model do not matter to its topology") {
    for (const double scale : {1e-6, 1.0, 1e6}) {
        INFO("scale " << scale);
        common::TriangleMesh mesh = tests::torus(1, 0.4, 40, 20);
        for (Vector3d& p : mesh.positions) p *= scale;
        const std::optional<Reconstruction> result =
            reconstruct(received(object_of(mesh), 0.05, 0.3, 2));
        REQUIRE(result);
        REQUIRE(result->topology_as_promised);
    }
}

TEST_CASE("a broken promise is reported, an approximate one is not judged") {
    const sender::BroadcastObject object = object_of(tests::torus(1, 0.4, 40, 20));
    ReceivedObject part = received(object, 0, 0.5, 3);
    part.hint.euler_all = part.hint.euler_largest = -6;  // genus 4: not this object's
    const std::optional<Reconstruction> broken = reconstruct(part);
    REQUIRE(broken);
    REQUIRE_FALSE(broken->topology_as_promised);
    REQUIRE(broken->judged);
    part.hint.approximate = true;
    const std::optional<Reconstruction> unjudged = reconstruct(part);
    REQUIRE(unjudged);
    REQUIRE_FALSE(unjudged->judged);
}

TEST_CASE("edges that the sender names are there, and no others suffer for it") {
    // Its lids are closed by long triangles that no criterion of shape would choose.
    common::TriangleMesh mesh = tests::box({1.0, 1.0, 2.0}, 12);
    for (Vector3d& p : mesh.positions) p.z() += 0.15 * std::cos(5 * p.x()) * std::cos(5 * p.y());
    const sender::BroadcastObject object = object_of(mesh);
    REQUIRE(object.edges.size() > 5);
    const double vertex_loss = GENERATE(0.0, 0.3);
    ReceivedObject without = received(object, 0.0, vertex_loss, 1);
    ReceivedObject with = without;
    with.edges = object.edges;
    std::sort(with.edges.begin(), with.edges.end());
    const Reconstruction result = reconstruct(with, {}).value();
    CHECK(result.topology_as_promised);
    require_positions_kept(with, result);
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const common::Triangle& t : result.mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) {
            edges.emplace(result.vertex_index[t[c]], result.vertex_index[t[(c + 1) % 3]]);
        }
    }
    std::size_t usable = 0;
    std::size_t there = 0;
    for (const protocol::EdgeRecord& edge : with.edges) {
        const auto& known = with.vertex_index;
        if (known.back() >= edge.among) continue;
        if (!std::binary_search(known.begin(), known.end(), edge.a)) continue;
        if (!std::binary_search(known.begin(), known.end(), edge.b)) continue;
        ++usable;
        there += edges.contains({edge.a, edge.b}) ? 1 : 0;
    }
    REQUIRE(usable > 0);
    if (vertex_loss == 0.0) CHECK(10 * there >= 9 * usable);  // concealment splits edges
    const auto rms = [&](const Reconstruction& r) {
        return common::measure_distance(r.mesh, mesh, {.samples = 20'000}).rms();
    };
    if (vertex_loss == 0.0) CHECK(rms(result) <= rms(reconstruct(without, {}).value()));
}

TEST_CASE("an edge among the first vertices says nothing to whoever has later ones") {
    const sender::BroadcastObject object = object_of(tests::torus(3, 1, 40, 20));
    const std::uint32_t half = object.hint.vertices / 2;
    ReceivedObject whole = received(object, 0.0, 0.0, 1);
    ReceivedObject prefix = whole;
    prefix.vertex_index.resize(half);
    prefix.vertices.resize(half);
    // Edges that are not there: between vertices two edges apart in what the prefix gives.
    const Reconstruction plain = reconstruct(prefix, {.grid = 24, .conceal = false}).value();
    const auto is_edge = [](const Reconstruction& mesh, std::uint32_t a, std::uint32_t b) {
        return std::any_of(mesh.mesh.triangles.begin(), mesh.mesh.triangles.end(),
                           [&](const common::Triangle& t) {
                               int ends = 0;
                               for (const std::uint32_t v : t) {
                                   const std::uint32_t index = mesh.vertex_index[v];
                                   ends += index == a || index == b ? 1 : 0;
                               }
                               return ends == 2;
                           });
    };
    std::vector<protocol::EdgeRecord> edges;
    const auto& triangles = plain.mesh.triangles;
    for (std::size_t i = 0; i < triangles.size() && edges.size() < 12; i += 40) {
        for (const common::Triangle& t : triangles) {
            // A neighbour across an edge of triangle i: its far corner and that of i.
            const auto shared = [&](std::uint32_t v) {
                return std::find(t.begin(), t.end(), v) != t.end();
            };
            const common::Triangle& s = triangles[i];
            if (std::count_if(s.begin(), s.end(), shared) != 2) continue;
            const auto far = std::find_if_not(s.begin(), s.end(), shared);
            const auto other = std::find_if(t.begin(), t.end(), [&](std::uint32_t v) {
                return std::find(s.begin(), s.end(), v) == s.end();
            });
            const auto [a, b] = std::minmax({plain.vertex_index[*far], plain.vertex_index[*other]});
            if (b == kNotReceived || is_edge(plain, a, b)) continue;
            edges.push_back({half, a, b});
            break;
        }
    }
    REQUIRE(edges.size() >= 8);
    std::sort(edges.begin(), edges.end());
    prefix.edges = edges;
    const Reconstruction followed = reconstruct(prefix, {.grid = 24, .conceal = false}).value();
    const auto there = std::count_if(edges.begin(), edges.end(), [&](const auto& edge) {
        return is_edge(followed, edge.a, edge.b);
    });
    CHECK(there >= static_cast<std::ptrdiff_t>(edges.size() - 2));  // a fold may hide one

    const Reconstruction untold = reconstruct(whole, {}).value();
    whole.edges = edges;
    CHECK(reconstruct(whole, {}).value().mesh.triangles == untold.mesh.triangles);
}

TEST_CASE("whatever edges are named, the surface stays a closed manifold as promised") {
    const sender::BroadcastObject object = object_of(tests::torus(3, 1, 40, 20));
    ReceivedObject lied_to = received(object, 0.0, 0.2, 1);
    common::Random random(4);
    for (int k = 0; k < 300; ++k) {
        protocol::EdgeRecord edge;
        edge.among = object.hint.vertices;
        edge.b = 1 + static_cast<std::uint32_t>(random.below(edge.among - 1));
        edge.a = static_cast<std::uint32_t>(random.below(edge.b));
        lied_to.edges.push_back(edge);
    }
    std::sort(lied_to.edges.begin(), lied_to.edges.end());
    const Reconstruction result = reconstruct(lied_to, {}).value();
    CHECK(result.topology.closed);
    CHECK(result.topology.manifold);
    CHECK(result.topology_as_promised);
    require_positions_kept(lied_to, result);
    CHECK(reconstruct(lied_to, {.threads = 1}).value().mesh.triangles == result.mesh.triangles);
}

TEST_CASE("records that lie about the shape still give a closed manifold") {
    const sender::BroadcastObject object = object_of(tests::icosphere(3));
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        INFO("seed " << seed);
        common::Random random(seed);
        ReceivedObject part = received(object, 0.5, 0.5, seed);
        // Any position inside the hinted box passes the wire's checks.
        for (protocol::VertexRecord& v : part.vertices) {
            if (random.chance(0.7)) continue;
            for (std::size_t a = 0; a < 3; ++a) {
                const double t = random.uniform();
                v.position[a] =
                    static_cast<float>((1 - t) * part.hint.box_min[a] + t * part.hint.box_max[a]);
            }
        }
        for (protocol::EllipsoidRecord& e : part.ellipsoids) {
            if (random.chance(0.7)) continue;
            e.scalars[4] = static_cast<float>(random.uniform());
            e.scalars[6] = static_cast<float>(-random.uniform());
        }
        const std::optional<Reconstruction> result = reconstruct(part, {.grid = 40});
        REQUIRE(result);
        REQUIRE(result->topology.closed);
        REQUIRE(result->topology.manifold);
    }
}

}  // namespace
}  // namespace ellicast::receiver
