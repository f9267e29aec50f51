// tests/support/comparison_test.cpp
#include "tests/support/comparison.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <string>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace ellicast::tests;

namespace {

ComparisonOptions quick() {
    ComparisonOptions options;
    options.decomposition.ellipsoids = 60;
    options.decomposition.candidates = 300;
    options.decomposition.grid = 64;
    options.samples = 2'000;
    return options;
}

// A ring of 3200 vertices, about 45 datagrams.
const ComparedModel& ring() {
    static const ComparedModel model = [] {
        const TemporaryDirectory directory;
        const auto path = directory.path() / "ring.ply";
        common::write_ply(path, torus(1.0, 0.4, 80, 40));
        return load_compared(path, quick());
    }();
    return model;
}

std::map<std::string, ComparisonRow> run(const Cell& cell) {
    std::map<std::string, ComparisonRow> rows;
    for (const ComparisonRow& row : run_cell(ring(), cell, quick())) rows[row.method] = row;
    return rows;
}

}  // namespace

TEST_CASE("with nothing lost the floor and the progressive orders are exact") {
    const auto rows = run({0, 1, 1});
    CHECK(rows.size() == all_methods().size());
    for (const char* method : {"floor", "progressive", "progressive-packed"}) {
        CAPTURE(method);
        CHECK(rows.at(method).rms < 1e-7);  // float32 of the file and of the wire are the same
        CHECK(rows.at(method).topology_right);
    }
    CHECK(rows.at("ellicast").vertices == 3'200);
    CHECK(rows.at("ellicast").bytes == rows.at("ellicast").stream_bytes);
}

TEST_CASE("all methods stand on what the same datagrams left") {
    const Cell cell{0.4, 1, 3};
    const CellReception reception = receive_cell(ring(), cell, 0);
    const std::vector<bool> kept = kept_vertices(ring(), reception.object);
    CHECK(static_cast<std::size_t>(std::count(kept.begin(), kept.end(), true)) ==
          reception.object.vertices.size());
    CHECK(reception.object.vertices.size() < 3'200);
    CHECK(reception.bytes_in_order < reception.bytes);
    CHECK(reception.bytes < ring().stream_bytes);
    const auto rows = run(cell);
    for (const Variant& variant : variants()) {
        CHECK(rows.at(std::string(variant.name)).vertices == reception.object.vertices.size());
    }
    CHECK(rows.at("floor").vertices == reception.object.vertices.size());
    CHECK(rows.at("floor").left_over == 0);
    CHECK(rows.at("floor").topology_right);
    CHECK(rows.at("progressive").bytes == reception.bytes_in_order);
}

TEST_CASE("tags cost bytes, and the variants have nothing else in another place") {
    const auto rows = run({0.3, 1, 1});
    const ComparisonRow& plain = rows.at("ellicast");
    const ComparisonRow& tags = rows.at("ellicast-tags");
    CHECK(tags.vertices == plain.vertices);
    CHECK(tags.ellipsoids == plain.ellipsoids);
    CHECK(tags.stream_bytes > plain.stream_bytes + 3'200);
    CHECK(tags.stream_bytes < plain.stream_bytes + 2 * 3'200);
    CHECK(tags.bytes > plain.bytes);
    CHECK(ring().variants[2].object.vertices[5].position ==
          ring().variants[0].object.vertices[5].position);
    CHECK(ring().variants[2].object.hint.format.normal_bits == 8);
}

TEST_CASE("a prefix is the beginning of the stream") {
    const CellReception whole = receive_cell(ring(), {0, 1, 1}, 0);
    const CellReception half = receive_cell(ring(), {0, 0.5, 1}, 0);
    CHECK(whole.datagrams == ring().stream.size());
    CHECK(half.datagrams == (ring().stream.size() + 1) / 2);
    CHECK(half.bytes == half.bytes_in_order);
    CHECK(receive_cell(ring(), {1, 1, 1}, 0).object.vertices.empty());
}

TEST_CASE("bursts lose neighbours on the wire") {
    // The same share, in fewer stretches.
    const auto stretches = [](double burst) {
        std::size_t in_order = 0;
        for (unsigned seed = 1; seed <= 40; ++seed) {
            in_order += receive_cell(ring(), {0.3, 1, seed}, burst).bytes_in_order;
        }
        return in_order;
    };
    CHECK(stretches(20) > 2 * stretches(0));
}

#ifdef ELLICAST_WITH_DRACO
TEST_CASE("Draco comes whole while the bytes that arrived are at least its own") {
    REQUIRE(ring().draco_bytes > 0);
    const ComparisonRow whole = run({0.2, 1, 1}).at("draco-mds");
    CHECK(whole.bytes >= ring().draco_bytes);
    CHECK(whole.rms < 1e-4);
    CHECK(whole.topology_right);
    const ComparisonRow nothing = run({0, 0.05, 1}).at("draco-mds");
    CHECK(nothing.bytes < ring().draco_bytes);
    CHECK_FALSE(nothing.has_surface());
    CHECK(nothing.vertices == 0);
}
#endif

TEST_CASE("an unknown method is refused") {
    ComparisonOptions options = quick();
    options.methods = {"magic"};
    CHECK_THROWS_AS(run_cell(ring(), {0, 1, 1}, options), std::invalid_argument);
}
