// tests/system/acceptance_test.cpp: the numbers to show, on the reference models.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "common/solid_voxels.hpp"
#include "receiver/output_files.hpp"
#include "receiver/reconstruction.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/sampling_gaps.hpp"
#include "tests/support/simulation.hpp"

using namespace ellicast;
using Bits = std::array<float, 3>;

namespace {

constexpr unsigned kSeeds = 5;

/// The model by the name of its file; empty, with a line that says so, without the models.
std::optional<tests::SimulatedModel> reference_model(const std::string& name,
                                                     const sender::TagOptions& tags = {}) {
    const auto directory = tests::models_dir();
    if (!directory) {
        WARN("SKIPPED: no reference models here (set ELLICAST_MODELS); " << name << " not tried");
        return std::nullopt;
    }
    return tests::load_simulated(*directory / (name + ".ply"), {}, tags);
}

struct Run {
    receiver::ReceivedObject object;
    receiver::Reconstruction result;
    common::MeshDistance distance;
    double cpu_seconds = 0;  // of the reconstruction
};

Run run(const tests::SimulatedModel& model, const common::ImpairmentOptions& loss) {
    const tests::BroadcastOptions how{.impairment = loss};
    auto reception = tests::receive(tests::broadcast(model.loaded.object, how));
    REQUIRE(reception.object.has_value());
    const double start = tests::cpu_seconds();
    auto result = receiver::reconstruct(*reception.object);
    const double took = tests::cpu_seconds() - start;
    REQUIRE(result.has_value());
    const common::MeshDistance distance = common::measure_distance(result->mesh, model.original);
    return {*std::move(reception.object), *std::move(result), distance, took};
}

/// The figures of a run as a line of the log.
std::string figures(const std::string& name, const Run& run) {
    std::array<char, 300> line{};
    const common::MeshTopology topology = common::analyse_topology(run.result.mesh);
    std::snprintf(
        line.data(), line.size(),
        "%s: %zu vertices, %zu ellipsoids; rms %.2e (%.2e/%.2e), mean %.2e, max %.2e, normals "
        "%.2f deg, components %zu, genus %lld, not inserted %zu, reconstruction %.2f s CPU",
        name.c_str(), run.object.vertices.size(), run.object.ellipsoids.size(), run.distance.rms(),
        run.distance.rms_to_reference, run.distance.rms_from_reference, run.distance.mean(),
        run.distance.max, run.distance.normal_deg, topology.components,
        static_cast<long long>(topology.genus()), run.result.not_inserted.size(), run.cpu_seconds);
    return line.data();
}

/// Judged from the triangles alone, not by what the reconstruction says of itself.
void check_topology(const Run& run, std::int64_t genus) {
    const common::MeshTopology topology = common::analyse_topology(run.result.mesh);
    CHECK(topology.closed);
    CHECK(topology.manifold);
    CHECK(topology.components == 1);
    CHECK(topology.genus() == genus);
    CHECK(tests::is_as_hinted(topology, run.object.hint));
    CHECK(run.result.topology_as_promised);
}

Bits bits_of(const Eigen::Vector3d& p) {
    return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

/// Positions that triangles use.
std::set<Bits> vertices_of(const common::TriangleMesh& mesh) {
    std::set<Bits> positions;
    for (const common::Triangle& triangle : mesh.triangles) {
        for (const std::uint32_t corner : triangle) {
            positions.insert(bits_of(mesh.positions[corner]));
        }
    }
    return positions;
}

/// Every received position is a vertex of the file, bit for bit, but those listed as not inserted,
/// and the file has no other vertices.
void check_vertices(const Run& run) {
    const tests::TemporaryDirectory directory;
    const auto path = directory.path() / "out.ply";
    receiver::write_mesh(path, run.result, run.object);
    const std::set<Bits> written = vertices_of(common::read_model(path));

    std::set<Bits> received;
    for (const Eigen::Vector3d& p : tests::received_positions(run.object)) {
        received.insert(bits_of(p));
    }
    std::set<Bits> listed;
    for (const std::uint32_t index : run.result.not_inserted) {
        const auto& indices = run.object.vertex_index;
        const auto at = std::lower_bound(indices.begin(), indices.end(), index);
        REQUIRE((at != indices.end() && *at == index));
        const auto& [x, y, z] =
            run.object.vertices[static_cast<std::size_t>(at - indices.begin())].position;
        listed.insert(bits_of({x, y, z}));
    }
    std::size_t missing = 0;
    for (const Bits& position : received) {
        missing += written.count(position) + listed.count(position) == 0 ? 1 : 0;
    }
    std::size_t foreign = 0;
    for (const Bits& position : written) foreign += received.count(position) == 0 ? 1 : 0;
    CHECK(missing == 0);
    CHECK(foreign == 0);
    CHECK(1000 * run.result.not_inserted.size() <= run.object.vertices.size());
    CHECK(std::count(run.result.vertex_index.begin(), run.result.vertex_index.end(),
                     receiver::kNotReceived) == 0);
}

void check_without_loss(const std::string& name, std::int64_t genus, double rms) {
    const auto model = reference_model(name, {.normal_bits = 0});
    if (!model) return;
    const Run whole = run(*model, {});
    WARN(figures(name + ", no loss", whole));
    CHECK(receiver::is_complete(whole.object));
    CHECK(receiver::id_matches(whole.object));
    CHECK_FALSE(model->loaded.promise.approximate);
    check_topology(whole, genus);
    check_vertices(whole);
    CHECK(whole.distance.rms() <= rms);
}

void check_with_loss(const std::string& name, double drop, std::int64_t genus, double rms,
                     double max = 1.0) {
    const auto model = reference_model(name);
    if (!model) return;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        CAPTURE(seed);
        common::ImpairmentOptions loss;
        loss.drop = drop;
        loss.seed = seed;
        const Run some = run(*model, loss);
        const std::string percent = std::to_string(static_cast<int>(100 * drop + 0.5));
        WARN(figures(name + ", drop " + percent + " %, seed " + std::to_string(seed), some));
        check_topology(some, genus);
        CHECK(some.distance.rms() <= rms);
        CHECK(some.distance.max <= max);
    }
}

/// Gaps between the received vertices, and the mesh of them, which must be what was promised.
tests::SamplingGaps check_reception(const tests::SimulatedModel& model,
                                    const std::vector<tests::TimedDatagram>& heard) {
    receiver::SessionOptions listening;
    listening.wait = std::chrono::seconds(10);
    const auto reception = tests::receive(heard, listening);
    REQUIRE(reception.object);
    const auto result = receiver::reconstruct(*reception.object);
    REQUIRE(result);
    const common::MeshTopology topology = common::analyse_topology(result->mesh);
    CHECK(tests::is_as_hinted(topology, reception.object->hint));
    return tests::sampling_gaps(model.original.positions,
                                tests::received_positions(*reception.object));
}

/// Two seconds of ten, at the start of a round, in its middle, and at its end, beside the worst of
/// three losses of as many datagrams anywhere.
void check_blackouts(const std::string& name) {
    const auto model = reference_model(name);
    if (!model) return;
    const auto sent =
        tests::stretched(tests::broadcast(model->loaded.object), std::chrono::milliseconds(9999));
    const auto lasted = std::chrono::seconds(2);
    const std::size_t as_many =
        tests::without_blackout(sent, std::chrono::seconds(4), std::chrono::seconds(6)).size();
    tests::SamplingGaps anywhere;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        const auto gaps = check_reception(*model, tests::some_of(sent, as_many, seed));
        anywhere.percentile_99 = std::max(anywhere.percentile_99, gaps.percentile_99);
        anywhere.largest = std::max(anywhere.largest, gaps.largest);
    }
    for (const int begin : {0, 4, 8}) {
        const std::chrono::seconds at(begin);
        const auto gaps = check_reception(*model, tests::without_blackout(sent, at, at + lasted));
        WARN(name << ", silent from " << begin << " s: of the gaps 99 % below "
                  << gaps.percentile_99 << " (anywhere " << anywhere.percentile_99
                  << "), the largest " << gaps.largest << " (" << anywhere.largest << ")");
        CHECK(gaps.percentile_99 <= 1.3 * anywhere.percentile_99);
        CHECK(gaps.largest <= 2.5 * anywhere.largest);
    }
}

}  // namespace

TEST_CASE("horse arrives whole without loss", "[long]") {
    check_without_loss("horse", 0, 1.3e-4);
}
TEST_CASE("stanford-bunny arrives whole without loss, its holes closed", "[long]") {
    check_without_loss("stanford-bunny", 0, 3.5e-4);
}
TEST_CASE("rocker-arm arrives whole without loss", "[long]") {
    check_without_loss("rocker-arm", 1, 2e-4);
}
TEST_CASE("fertility arrives whole without loss", "[long]") {
    check_without_loss("fertility", 4, 3.5e-4);
}
TEST_CASE("spot arrives whole without loss", "[long]") {
    check_without_loss("spot", 0, 2e-4);
}
TEST_CASE("homer arrives whole without loss", "[long]") {
    check_without_loss("homer", 0, 2e-4);
}

TEST_CASE("horse survives 30 % loss, five seeds of five", "[long]") {
    check_with_loss("horse", 0.3, 0, 2.2e-4, 0.02);
}
TEST_CASE("horse survives 50 % loss, five seeds of five", "[long]") {
    check_with_loss("horse", 0.5, 0, 3.0e-4, 0.02);
}
TEST_CASE("fertility keeps its four handles at 30 % loss, five seeds of five", "[long]") {
    check_with_loss("fertility", 0.3, 4, 6e-4);
}
TEST_CASE("rocker-arm keeps its hole at 30 % loss, five seeds of five", "[long]") {
    check_with_loss("rocker-arm", 0.3, 1, 4e-4);
}

TEST_CASE("a blackout of two seconds in ten leaves horse closed and evenly sampled", "[long]") {
    check_blackouts("horse");
}
TEST_CASE("and fertility, which has handles", "[long]") {
    check_blackouts("fertility");
}

TEST_CASE("ellipsoids alone make horse's shape", "[long]") {
    const auto model = reference_model("horse");
    if (!model) return;
    common::ImpairmentOptions loss;
    loss.drop_vertices = 1.0;
    const Run coarse = run(*model, loss);
    CHECK(coarse.object.vertices.empty());
    check_topology(coarse, 0);
    const double overlap = common::volume_overlap(coarse.result.mesh, model->original);
    WARN(figures("horse, no vertices", coarse) << ", IoU " << overlap);
    CHECK(overlap >= 0.93);
}

TEST_CASE("any single datagram of horse that holds ellipsoids makes a closed mesh", "[long]") {
    const auto model = reference_model("horse");
    if (!model) return;
    receiver::ReconstructionOptions how;
    how.grid = 48;  // hundreds of runs
    std::size_t tried = 0;
    std::size_t fewest = protocol::kMaxEllipsoids;
    for (const tests::TimedDatagram& datagram : tests::broadcast(model->loaded.object)) {
        const auto reception = tests::receive({datagram});
        REQUIRE(reception.object.has_value());
        if (reception.object->ellipsoids.empty()) continue;
        ++tried;
        fewest = std::min(fewest, reception.object->ellipsoids.size());
        const auto result = receiver::reconstruct(*reception.object, how);
        REQUIRE(result.has_value());
        const common::MeshTopology topology = common::analyse_topology(result->mesh);
        REQUIRE(topology.closed);
        REQUIRE(topology.manifold);
    }
    WARN("horse: each of " << tried << " datagrams with ellipsoids alone, of which the poorest has "
                           << fewest << ", gives a closed manifold");
    CHECK(tried >= 50);
}

TEST_CASE("horse at 30 % loss gives one file, whatever the order, copies and threads", "[long]") {
    const auto model = reference_model("horse");
    if (!model) return;
    tests::BroadcastOptions how;
    how.impairment.drop = 0.3;
    const auto datagrams = tests::broadcast(model->loaded.object, how);
    const std::string straight = tests::written_bytes(tests::receive(datagrams), 1);
    CHECK_FALSE(straight.empty());
    CHECK(tests::written_bytes(tests::receive(datagrams), 2) == straight);
    for (const std::uint64_t seed : {1u, 2u}) {
        CAPTURE(seed);
        const auto mixed = tests::shuffled_with_copies(datagrams, seed);
        CHECK(tests::written_bytes(tests::receive(mixed), 2) == straight);
    }
}
