// tests/system/simulation_test.cpp: both cores joined in one process, on made models.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "receiver/output_files.hpp"
#include "receiver/reconstruction.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/sampling_gaps.hpp"
#include "tests/support/simulation.hpp"

using namespace ellicast;

namespace {

constexpr int kGrid = 40;  // coarse, for quick runs

sender::DecompositionOptions quick(unsigned threads = 0) {
    sender::DecompositionOptions options;
    options.ellipsoids = 60;
    options.candidates = 400;
    options.grid = 50;
    options.threads = threads;
    return options;
}

tests::SimulatedModel made(const common::TriangleMesh& mesh,
                           const sender::DecompositionOptions& options = quick()) {
    const tests::TemporaryDirectory directory;
    const auto path = directory.path() / "made.ply";
    common::write_ply(path, mesh);
    return tests::load_simulated(path, options);
}

const tests::SimulatedModel& ring() {
    static const tests::SimulatedModel model = made(tests::torus(1.0, 0.4, 60, 30));
    return model;
}

receiver::Reconstruction rebuilt(const receiver::ReceivedObject& object) {
    receiver::ReconstructionOptions how;
    how.grid = kGrid;
    auto result = receiver::reconstruct(object, how);
    REQUIRE(result.has_value());
    return *std::move(result);
}

bool is_closed_manifold(const common::TriangleMesh& mesh) {
    const common::MeshTopology topology = common::analyse_topology(mesh);
    return topology.closed && topology.manifold;
}

std::vector<std::vector<std::uint8_t>> bytes_of(const std::vector<tests::TimedDatagram>& sent) {
    std::vector<std::vector<std::uint8_t>> bytes;
    for (const tests::TimedDatagram& datagram : sent) bytes.push_back(datagram.bytes);
    return bytes;
}

}  // namespace

TEST_CASE("without loss the ring arrives whole, ends by itself, and is what it was") {
    const auto reception = tests::receive(tests::broadcast(ring().loaded.object));
    REQUIRE(reception.object.has_value());
    CHECK(reception.summary.ends_by == receiver::EndReason::complete);
    CHECK(receiver::id_matches(*reception.object));
    const receiver::Reconstruction result = rebuilt(*reception.object);
    CHECK(tests::is_as_hinted(common::analyse_topology(result.mesh), reception.object->hint));
    CHECK(result.topology.genus() == 1);
    CHECK(result.not_inserted.empty());
    const common::MeshDistance distance =
        common::measure_distance(result.mesh, ring().original, {.samples = 20'000});
    CHECK(distance.rms() < 2e-3);
}

TEST_CASE("the sender's object and rounds do not depend on threads, but on the seed") {
    for (const auto& mesh : {tests::torus(1.0, 0.4, 60, 30), tests::two_parts()}) {
        const tests::SimulatedModel one = made(mesh, quick(1));
        const tests::SimulatedModel two = made(mesh, quick(2));
        const sender::BroadcastObject& a = one.loaded.object;
        const sender::BroadcastObject& b = two.loaded.object;
        CHECK(a.id == b.id);
        CHECK(a.hint == b.hint);
        CHECK(a.ellipsoids == b.ellipsoids);
        CHECK(a.vertices == b.vertices);
        CHECK(bytes_of(tests::broadcast(a)) == bytes_of(tests::broadcast(b)));
        sender::DecompositionOptions other = quick(1);
        other.seed = 2;
        CHECK(made(mesh, other).loaded.object.id != a.id);
    }
}

TEST_CASE("order, copies and threads change no byte of the file") {
    for (const double drop : {0.0, 0.3, 0.7}) {
        tests::BroadcastOptions how;
        how.impairment.drop = drop;
        how.impairment.seed = 3;
        const auto datagrams = tests::broadcast(ring().loaded.object, how);
        const std::string straight = tests::written_bytes(tests::receive(datagrams), 1, kGrid);
        CHECK_FALSE(straight.empty());
        CHECK(tests::written_bytes(tests::receive(datagrams), 2, kGrid) == straight);
        for (std::uint64_t seed = 1; seed <= 3; ++seed) {
            CAPTURE(drop, seed);
            const auto mixed = tests::shuffled_with_copies(datagrams, seed);
            CHECK(tests::written_bytes(tests::receive(mixed), 2, kGrid) == straight);
        }
    }
}

TEST_CASE("one more or one fewer vertex does change the file") {
    const auto datagrams = tests::broadcast(ring().loaded.object);
    auto reception = tests::receive(datagrams);
    const std::string whole = tests::written_bytes(reception, 1, kGrid);
    reception.object->vertices.pop_back();
    reception.object->vertex_index.pop_back();
    CHECK(tests::written_bytes(reception, 1, kGrid) != whole);
}

TEST_CASE("any single datagram that holds ellipsoids gives a closed manifold") {
    std::size_t tried = 0;
    for (const tests::TimedDatagram& datagram : tests::broadcast(ring().loaded.object)) {
        const auto reception = tests::receive({datagram});
        REQUIRE(reception.object.has_value());
        if (reception.object->ellipsoids.empty()) continue;
        ++tried;
        REQUIRE(is_closed_manifold(rebuilt(*reception.object).mesh));
    }
    CHECK(tried >= 5);
}

TEST_CASE("whatever the losses, what was received is a closed manifold with it as vertices") {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        CAPTURE(seed);
        tests::BroadcastOptions how;
        how.datagram_bytes = 576;
        how.impairment.seed = seed;
        how.impairment.drop = 0.08 * static_cast<double>(seed);
        how.impairment.duplicate = 0.2;
        how.impairment.reorder = 0.2;
        how.impairment.corrupt = 0.1;
        how.rounds = seed % 3 == 0 ? 2 : 1;
        const auto reception = tests::receive(tests::broadcast(ring().loaded.object, how));
        if (!reception.object || reception.object->ellipsoids.empty()) continue;
        const receiver::Reconstruction result = rebuilt(*reception.object);
        CHECK(is_closed_manifold(result.mesh));
        std::set<std::uint32_t> there(result.vertex_index.begin(), result.vertex_index.end());
        there.insert(result.not_inserted.begin(), result.not_inserted.end());
        std::size_t missing = 0;
        for (const std::uint32_t index : reception.object->vertex_index) {
            missing += there.count(index) == 0 ? 1 : 0;
        }
        CHECK(missing == 0);
        CHECK(result.not_inserted.size() * 100 <= reception.object->vertices.size());
    }
}

TEST_CASE("colours and tags cross with their vertices and land in the file") {
    common::TriangleMesh mesh = tests::torus(1.0, 0.4, 60, 30);
    std::map<std::array<float, 3>, common::Colour> expected;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        mesh.colours.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v / 8),
                                static_cast<std::uint8_t>(255 - v % 100)});
        const Eigen::Vector3f p = mesh.positions[v].cast<float>();
        expected[{p.x(), p.y(), p.z()}] = mesh.colours[v];
    }
    const tests::TemporaryDirectory directory;
    const auto path = directory.path() / "made.ply";
    common::write_ply(path, mesh);
    const sender::TagOptions tags{.normal_bits = 12, .ring = true};
    const auto model = tests::load_simulated(path, quick(), tags);
    CHECK(model.loaded.object.hint.format.colour);

    tests::BroadcastOptions how;
    how.impairment.drop = GENERATE(0.0, 0.5);
    const auto reception = tests::receive(tests::broadcast(model.loaded.object, how));
    REQUIRE(reception.object.has_value());
    for (std::size_t k = 0; k < reception.object->vertices.size(); ++k) {
        REQUIRE(reception.object->vertices[k] ==
                model.loaded.object.vertices[reception.object->vertex_index[k]]);
    }
    const receiver::Reconstruction result = rebuilt(*reception.object);
    receiver::write_mesh(directory.path() / "out.ply", result, *reception.object);
    const common::TriangleMesh out = common::read_model(directory.path() / "out.ply");
    REQUIRE(out.colours.size() == out.positions.size());
    std::size_t own = 0;
    for (std::size_t v = 0; v < out.positions.size(); ++v) {
        if (result.vertex_index[v] == receiver::kNotReceived) continue;
        const Eigen::Vector3f p = out.positions[v].cast<float>();
        REQUIRE(out.colours[v] == expected.at({p.x(), p.y(), p.z()}));
        ++own;
    }
    CHECK(own + result.not_inserted.size() == reception.object->vertices.size());
}

TEST_CASE("losses in bursts have the share and the length asked for") {
    const common::GilbertLoss loss = tests::bursty_loss(0.3, 8);
    CHECK(loss.good_to_bad / (loss.good_to_bad + loss.bad_to_good) == Approx(0.3));
    CHECK(1.0 / loss.bad_to_good == Approx(8));
    CHECK_THROWS_AS(tests::bursty_loss(0.9, 2), std::invalid_argument);
    CHECK_THROWS_AS(tests::bursty_loss(0.3, 0.5), std::invalid_argument);
}

namespace {

constexpr std::chrono::nanoseconds kStream = std::chrono::milliseconds(9999);
constexpr std::chrono::nanoseconds kBlackout = std::chrono::seconds(2);

/// A round as a stream of ten seconds, and what is heard of it when two of them are silent.
struct Blackout {
    std::vector<tests::TimedDatagram> sent;
    std::vector<tests::TimedDatagram> heard;
};
Blackout blackout(const sender::BroadcastObject& object, std::chrono::nanoseconds begin) {
    Blackout made;
    made.sent = tests::stretched(tests::broadcast(object), kStream);
    made.heard = tests::without_blackout(made.sent, begin, begin + kBlackout);
    return made;
}

/// With the silence that the program waits out by default.
tests::SimulatedReception listen(const std::vector<tests::TimedDatagram>& heard) {
    receiver::SessionOptions options;
    options.wait = kStream;
    tests::SimulatedReception reception = tests::receive(heard, options);
    REQUIRE(reception.object);
    return reception;
}

tests::SamplingGaps gaps_of(const tests::SimulatedModel& model,
                            const receiver::ReceivedObject& object) {
    return tests::sampling_gaps(model.original.positions, tests::received_positions(object));
}

/// What as many datagrams, lost anywhere, leave: medians of some seeds.
tests::SamplingGaps gaps_anywhere(const tests::SimulatedModel& model, const Blackout& blackout) {
    constexpr std::size_t kSeeds = 9;
    std::vector<double> percentiles;
    std::vector<double> largest;
    for (std::size_t seed = 1; seed <= kSeeds; ++seed) {
        const auto heard = tests::some_of(blackout.sent, blackout.heard.size(), seed);
        const tests::SamplingGaps gaps = gaps_of(model, *listen(heard).object);
        percentiles.push_back(gaps.percentile_99);
        largest.push_back(gaps.largest);
    }
    std::sort(percentiles.begin(), percentiles.end());
    std::sort(largest.begin(), largest.end());
    return {percentiles[kSeeds / 2], largest[kSeeds / 2]};
}

/// Its vertices along an axis: those of one datagram are neighbours.
tests::SimulatedModel in_slices(tests::SimulatedModel model) {
    std::sort(model.loaded.object.vertices.begin(), model.loaded.object.vertices.end(),
              [](const auto& a, const auto& b) { return a.position < b.position; });
    return model;
}

}  // namespace

TEST_CASE("a blackout of two seconds in a stream of ten leaves a closed mesh") {
    const std::chrono::milliseconds begin(GENERATE(0, 2000, 4000, 7900, 8000));
    CAPTURE(begin.count());
    const Blackout made = blackout(ring().loaded.object, begin);
    const tests::SimulatedReception reception = listen(made.heard);
    const receiver::StreamCounts& counts = reception.summary.datagrams;
    CHECK(counts.received == made.heard.size());
    const std::uint64_t lost = made.sent.size() - made.heard.size();
    CHECK(lost >= made.sent.size() / 5);
    // Of a stream that was joined late, nobody knows what went before.
    if (begin.count() > 0) CHECK(counts.lost == lost);
    if (begin.count() > 0 && begin + kBlackout < kStream) {
        CHECK(counts.pattern.longest_run == lost);
    }
    const receiver::Reconstruction result = rebuilt(*reception.object);
    CHECK(is_closed_manifold(result.mesh));
    CHECK(result.topology_as_promised);
}

TEST_CASE("what a blackout leaves is as evenly sampled as by losses anywhere") {
    const std::chrono::milliseconds begin(GENERATE(0, 2000, 4000, 6000, 8000));
    CAPTURE(begin.count());
    const Blackout made = blackout(ring().loaded.object, begin);
    const tests::SamplingGaps gaps = gaps_of(ring(), *listen(made.heard).object);
    const tests::SamplingGaps anywhere = gaps_anywhere(ring(), made);
    CAPTURE(gaps.percentile_99, anywhere.percentile_99, gaps.largest, anywhere.largest);
    CHECK(gaps.percentile_99 <= 1.25 * anywhere.percentile_99);
    CHECK(gaps.largest <= 1.5 * anywhere.largest);
}

TEST_CASE("of a model that is sent slice by slice a blackout leaves a hole, which gaps show") {
    static const tests::SimulatedModel sliced = in_slices(ring());
    const Blackout made = blackout(sliced.loaded.object, std::chrono::seconds(4));
    const tests::SamplingGaps gaps = gaps_of(sliced, *listen(made.heard).object);
    const tests::SamplingGaps spread = gaps_of(
        ring(), *listen(blackout(ring().loaded.object, std::chrono::seconds(4)).heard).object);
    CHECK(gaps.percentile_99 > 2.0 * spread.percentile_99);
}
