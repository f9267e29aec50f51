// tests/receiver/report_test.cpp
#include "receiver/report.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"

using namespace ellicast;
using namespace ellicast::receiver;

namespace {

std::vector<std::string> keys(const nlohmann::ordered_json& object) {
    std::vector<std::string> names;
    for (const auto& [name, value] : object.items()) names.push_back(name);
    return names;
}

using Names = std::vector<std::string>;

// A run with something to say everywhere.
struct Run {
    Run() {
        object.hint.ellipsoids = 3;
        object.hint.vertices = 10;
        object.ellipsoids.resize(2);
        object.ellipsoid_index = {0, 2};
        object.vertices.resize(4);
        object.vertex_index = {1, 3, 5, 7};
        reconstruction.vertex_index = {1, kNotReceived, 3, 5};
        reconstruction.not_inserted = {7};
        reconstruction.provenance = {Provenance::received, Provenance::concealed,
                                     Provenance::received, Provenance::received};
        reconstruction.summary.missing = 6;
        reconstruction.summary.largest_gap = {Eigen::Vector3d(1, 2, 0.5), 0.25};
        reconstruction.summary.farther[1] = {0.125, 0.375};
        reconstruction.summary.octants[5] = {3, 7.5};
        reconstruction.topology.components = 1;
        reconstruction.topology.euler = -6;
        reconstruction.topology.closed = reconstruction.topology.manifold = true;
        quality.rms_to_reference = 0.25;
        quality.rms_from_reference = 0.5;
        content.session.ends_by = EndReason::idle;
        content.session.datagrams.received = 20;
        content.session.datagrams.lost = 9;
        content.session.datagrams.duplicate = 1;
        content.session.malformed.add(protocol::WireError::bad_hint);
        content.kernel_dropped = 4;
        content.object = &object;
        content.reconstruction = &reconstruction;
        content.quality = &quality;
        content.output = "x.ply";
        content.times = {{"receive", 1.5, 0.1}, {"insert", 0.5, 0.75}};
    }
    ReceivedObject object;
    Reconstruction reconstruction;
    common::MeshDistance quality;
    ReportContent content;
};

}  // namespace

TEST_CASE("the report has the documented keys") {
    const Run run;
    const auto report = make_report(run.content);
    CHECK(keys(report) == Names{"program",      "version",      "ends_by",       "output",
                                "object",       "hint",         "record_format", "datagrams",
                                "authenticity", "ellipsoids",   "vertices",      "edges",
                                "records",      "others",       "live",          "mesh",
                                "confidence",   "not_inserted", "quality",       "seconds",
                                "pages"});
    CHECK(report["live"].is_null());
    CHECK(keys(report["object"]) == Names{"id", "name", "unit", "complete", "id_verified"});
    CHECK(keys(report["record_format"]) == Names{"normal_bits", "ring", "colour"});
    CHECK(keys(report["datagrams"]) ==
          Names{"received", "lost", "duplicate", "reordered", "malformed", "kernel_dropped",
                "bytes", "lost_in_network", "jitter_ms", "loss_rate", "recent", "reorder", "runs",
                "bursts", "gaps", "malformed_by", "refused", "refused_by", "unverified_dropped"});
    CHECK(keys(report["datagrams"]["refused_by"]) ==
          Names{"other_payload_type", "no_key", "not_sealed", "not_signed", "unknown_key",
                "bad_tag", "bad_signature", "replayed", "out_of_date"});
    CHECK(keys(report["authenticity"]) == Names{"signed", "sealed", "verified_by"});
    CHECK(report["authenticity"]["verified_by"].is_null());
    CHECK(keys(report["ellipsoids"]) == Names{"received", "expected"});
    CHECK(keys(report["vertices"]) == Names{"received", "expected", "in_mesh"});
    CHECK(keys(report["edges"]) == Names{"received"});
    CHECK(keys(report["mesh"]) == Names{"vertices", "faces", "components", "genus", "closed",
                                        "manifold", "topology_as_promised", "judged", "isolevel"});
    CHECK(keys(report["confidence"]) ==
          Names{"missing", "received", "concealed", "coarse", "largest_gap", "farther", "octants"});
    CHECK(keys(report["confidence"]["largest_gap"]) == Names{"center", "radius"});
    CHECK(keys(report["confidence"]["farther"][0]) == Names{"distance", "share"});
    CHECK(keys(report["confidence"]["octants"][0]) == Names{"received", "expected"});
    CHECK(keys(report["quality"]) ==
          Names{"rms", "mean", "max", "rms_to_reference", "rms_from_reference", "normal_deg"});
    CHECK(report["datagrams"]["malformed_by"].size() ==
          static_cast<std::size_t>(protocol::WireError::kCount));
}

TEST_CASE("the report counts rings where there are ring tags") {
    Run run;
    run.reconstruction.rings = RingAgreement{40, 2};
    const auto rings = make_report(run.content)["mesh"]["rings"];
    CHECK(rings["agree"] == 40);
    CHECK(rings["disagree"] == 2);
}

TEST_CASE("the report says what happened") {
    Run run;
    run.object.hint.format = {.normal_bits = 12, .ring = true};
    const auto report = make_report(run.content);
    CHECK(report["record_format"]["normal_bits"] == 12);
    CHECK(report["record_format"]["ring"] == true);
    CHECK(report["record_format"]["colour"] == false);
    CHECK(report["ends_by"] == "idle");
    CHECK(report["object"]["complete"] == false);
    CHECK(report["object"]["name"] == "0000000000000000");
    CHECK(report["datagrams"]["malformed"] == 1);
    CHECK(report["datagrams"]["malformed_by"]["bad_hint"] == 1);
    CHECK(report["datagrams"]["lost_in_network"] == 5);
    CHECK(report["vertices"]["received"] == 4);
    CHECK(report["vertices"]["expected"] == 10);
    CHECK(report["vertices"]["in_mesh"] == 3);
    CHECK(report["not_inserted"] == std::vector<int>{7});
    CHECK(report["mesh"]["genus"] == 4);
    const auto& confidence = report["confidence"];
    CHECK(confidence["missing"] == 6);
    CHECK(confidence["received"] == 3);
    CHECK(confidence["concealed"] == 1);
    CHECK(confidence["coarse"] == 0);
    CHECK(confidence["largest_gap"]["center"] == std::vector<double>{1, 2, 0.5});
    CHECK(confidence["largest_gap"]["radius"] == 0.25);
    CHECK(confidence["farther"][1]["share"] == 0.375);
    CHECK(confidence["octants"].size() == 8);
    CHECK(confidence["octants"][5]["received"] == 3);
    CHECK(confidence["octants"][5]["expected"] == 7.5);
    CHECK(report["quality"]["rms"] == 0.5);
    CHECK(report["seconds"]["insert"]["wall"] == 0.5);
    CHECK(report["seconds"]["insert"]["cpu"] == 0.75);
}

TEST_CASE("a report of nothing keeps its keys, but says null") {
    const auto report = make_report({});
    CHECK(report["object"].is_null());
    CHECK(report["hint"].is_null());
    CHECK(report["record_format"].is_null());
    CHECK(report["mesh"].is_null());
    CHECK(report["confidence"].is_null());
    CHECK(report["output"].is_null());
    CHECK(report["vertices"]["received"] == 0);
    CHECK_FALSE(report.contains("quality"));
}

TEST_CASE("a report is written whole, even with an output path that is no UTF-8") {
    const tests::TemporaryDirectory directory;
    Run run;
    run.content.output = "x\xff.ply";
    write_report(directory.path() / "r.json", run.content);
    const auto read = nlohmann::json::parse(tests::read_file(directory.path() / "r.json"));
    CHECK(read["vertices"]["expected"] == 10);
    CHECK_THROWS_AS(write_report(directory.path() / "no" / "r.json", run.content),
                    common::ModelError);
}

TEST_CASE("the summary for people names loss, topology and distance") {
    Run run;
    run.reconstruction.topology_as_promised = false;
    const std::string text = summary_text(run.content);
    CHECK(text.find("2 of 3 ellipsoids, 4 of 10 vertices") != std::string::npos);
    CHECK(text.find("9 lost (32.1 %)") != std::string::npos);
    CHECK(text.find("NOT as promised") != std::string::npos);
    CHECK(text.find("rms 5.00e-01") != std::string::npos);
    CHECK(text.find("6 vertices missing, 1 guessed; largest gap: radius 0.25 at (1, 2, 0.5); "
                    "37.5 % of the surface farther than 0.125 from") != std::string::npos);
    run.reconstruction.summary.missing = 0;
    CHECK(summary_text(run.content).find("missing") == std::string::npos);
    run.reconstruction.judged = false;
    CHECK(summary_text(run.content).find("not judged") != std::string::npos);
}

TEST_CASE("the report says when the first live mesh was there, and what the last one held") {
    ReportContent content;
    content.live.emplace();
    nlohmann::ordered_json live = make_report(content)["live"];
    CHECK(keys(live) == Names{"updates", "first_shape_ms", "last"});
    CHECK(live["updates"] == 0);
    CHECK(live["first_shape_ms"].is_null());
    CHECK(live["last"].is_null());

    content.live->updates = 2;
    content.live->first_shape = std::chrono::milliseconds(30);
    content.live->last_shape = std::chrono::milliseconds(600);
    content.live->last_vertices = 7;
    content.live->last_records = 9;
    live = make_report(content)["live"];
    CHECK(live["updates"] == 2);
    CHECK(live["first_shape_ms"] == 30.0);
    CHECK(live["last"]["ms"] == 600.0);
    CHECK(live["last"]["vertices"] == 7);
    CHECK(live["last"]["records"] == 9);
}
