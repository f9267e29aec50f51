// tests/system/send_program_test.cpp: the real ellicast-send, heard over loopback.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/model_io.hpp"
#include "protocol/datagram.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/udp_sink.hpp"

using namespace ellicast;
using namespace std::chrono_literals;
using nlohmann::json;
using tests::ChildProcess;
using tests::TemporaryDirectory;
using tests::UdpSink;
using Arguments = std::vector<std::string>;

namespace {

struct Outcome {
    int code;
    std::string out;
    std::string err;
};

Outcome run(const Arguments& arguments) {
    ChildProcess process(ELLICAST_SEND, arguments);
    const int code = process.wait(120s);
    return {code, process.out(), process.err()};
}

std::size_t lines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Few candidates, for quick runs.
Arguments quick(Arguments arguments) {
    arguments.insert(arguments.end(),
                     {"--candidates", "120", "--ellipsoids", "40", "--refine", "off"});
    return arguments;
}

/// A directory with a model in it.
struct Workplace {
    Workplace() { common::write_ply(model(), tests::icosphere(4)); }  // 2562 vertices

    [[nodiscard]] std::filesystem::path path(const std::string& name) const {
        return directory.path() / name;
    }
    [[nodiscard]] std::filesystem::path model() const { return path("ball.ply"); }
    [[nodiscard]] json report() const { return json::parse(tests::read_file(path("report.json"))); }
    void write(const std::string& name, const std::string& content) const {
        std::ofstream(path(name), std::ios::binary) << content;
    }
    /// Runs the program into a sink, with a report.
    Outcome send(UdpSink& sink, const Arguments& more = {}) const {
        Arguments arguments{model().string(), "--to", "127.0.0.1:" + std::to_string(sink.port()),
                            "--report", path("report.json").string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(quick(arguments));
    }

    TemporaryDirectory directory;
};

using Position = std::array<float, 3>;

/// What the datagrams of a sink say, by index.
struct Heard {
    std::map<std::uint32_t, std::array<float, 9>> ellipsoids;
    std::map<std::uint32_t, Position> vertices;
    std::set<protocol::ObjectId> objects;
    std::set<std::string> names;
    std::size_t bytes = 0;
    std::size_t ellipsoid_sections = 0;
    std::size_t vertex_sections = 0;
};

Heard heard(const std::vector<std::vector<std::uint8_t>>& datagrams) {
    Heard all;
    for (const std::vector<std::uint8_t>& datagram : datagrams) {
        const auto view = protocol::parse_datagram(datagram);
        REQUIRE(view.has_value());
        all.bytes += datagram.size();
        all.objects.insert(view->header.object);
        for (const protocol::SectionView& section : view->sections()) {
            if (section.kind == protocol::SectionKind::description) {
                all.names.insert(section.description().name);
                continue;
            }
            if (section.kind == protocol::SectionKind::edges) continue;
            const bool vertices = section.kind == protocol::SectionKind::vertices;
            ++(vertices ? all.vertex_sections : all.ellipsoid_sections);
            for (std::size_t k = 0; k < section.count; ++k) {
                const std::uint32_t index = section.index(k);
                if (vertices) all.vertices[index] = section.vertex(k).position;
                if (!vertices) all.ellipsoids[index] = section.ellipsoid(k).scalars;
            }
        }
    }
    return all;
}

}  // namespace

TEST_CASE("tags and colours are on the wire as asked for, and the report says which") {
    const Workplace place;
    common::TriangleMesh mesh = common::read_model(place.model());
    const bool coloured = GENERATE(true, false);
    if (coloured) mesh.colours.assign(mesh.positions.size(), common::Colour{1, 2, 3});
    common::write_ply(place.model(), mesh);
    struct Case {
        Arguments arguments;
        protocol::RecordFormat format;
    };
    for (const auto& [arguments, format] :
         {Case{{}, {8, false, coloured}}, Case{{"--colour", "off"}, {8, false, false}},
          Case{{"--tags", "12+ring", "--colour", "on"}, {12, true, coloured}},
          Case{{"--tags", "0", "--colour", "off"}, {0, false, false}}}) {
        UdpSink sink;
        const Outcome outcome = place.send(sink, arguments);
        INFO(outcome.err);
        REQUIRE(outcome.code == 0);
        const auto datagrams = sink.datagrams();
        const auto view = protocol::parse_datagram(datagrams.front());
        REQUIRE(view.has_value());
        CHECK(view->header.hint.format == format);
        const json said = place.report()["models"][0]["record_format"];
        CHECK(said["normal_bits"] == format.normal_bits);
        CHECK(said["ring"] == format.ring);
        CHECK(said["colour"] == format.colour);
    }
}

TEST_CASE("what is heard is the model, and the report counts it") {
    const Workplace place;
    UdpSink sink;
    const Outcome outcome = place.send(sink, {"--rounds", "2", "--rate", "50M"});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const Heard all = heard(sink.datagrams());
    const json report = place.report();
    const json& model = report["models"][0];
    const json& counts = report["sending"]["datagrams"];

    CHECK(counts["offered"] == sink.datagrams().size());
    CHECK(counts["sent"] == sink.datagrams().size());
    CHECK(counts["bytes"] == all.bytes);
    CHECK(counts["dropped_by_simulation"] == 0);
    CHECK(counts["refused"] == 0);
    CHECK(report["sending"]["rounds"] == 2);
    CHECK(report["sending"]["interrupted"] == false);
    CHECK(report["sending"]["rate"]["asked"] == 50'000'000);
    CHECK(model["datagrams"].get<std::size_t>() * 2 == sink.datagrams().size());
    CHECK(model["vertices"] == all.vertices.size());
    CHECK(model["ellipsoids"] == all.ellipsoids.size());
    CHECK(model["topology"]["euler_all"] == 2);
    CHECK(model["topology"]["approximate"] == false);
    CHECK(model["warnings"].empty());
    for (const char* stage : {"read", "prepare", "decompose", "promise", "object"}) {
        CHECK(model["seconds"][stage]["cpu"].get<double>() >= 0.0);
        CHECK(model["seconds"][stage]["wall"].get<double>() >= 0.0);
    }
    CHECK(all.objects.size() == 1);
    CHECK(all.names == std::set<std::string>{"ball"});

    std::set<Position> sent;
    for (const auto& [index, position] : all.vertices) sent.insert(position);
    std::set<Position> original;
    for (const Eigen::Vector3d& p : common::read_model(place.model()).positions) {
        original.insert(
            {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
    CHECK(sent == original);
}

TEST_CASE("the object does not depend on threads, the bytes only on seed and identity") {
    const Workplace place;
    const auto bytes_of = [&](const Arguments& more) {
        UdpSink sink;
        Arguments arguments{"--session", "0011223344556677",  "--ssrc", "7", "--first-sequence",
                            "65500",     "--first-timestamp", "1"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        REQUIRE(place.send(sink, arguments).code == 0);
        std::vector<std::vector<std::uint8_t>> datagrams = sink.datagrams();
        // The moment of sending is the only thing that differs.
        for (std::vector<std::uint8_t>& datagram : datagrams) protocol::stamp(datagram, 0, 0);
        return datagrams;
    };
    const auto one = bytes_of({"--threads", "1"});
    CHECK(one == bytes_of({"--threads", "2"}));
    CHECK(one != bytes_of({"--threads", "1", "--seed", "2"}));
}

TEST_CASE("two starts are two sessions of the same object") {
    const Workplace place;
    std::set<protocol::SessionId> sessions;
    std::set<protocol::ObjectId> objects;
    for (int k = 0; k < 2; ++k) {
        UdpSink sink;
        REQUIRE(place.send(sink).code == 0);
        const auto view = protocol::parse_datagram(sink.datagrams().front());
        REQUIRE(view.has_value());
        sessions.insert(view->header.session);
        objects.insert(view->header.object);
    }
    CHECK(sessions.size() == 2);
    CHECK(objects.size() == 1);
}

TEST_CASE("simulated loss leaves as many datagrams as the report says") {
    const Workplace place;
    UdpSink sink;
    REQUIRE(place.send(sink, {"--drop", "0.3", "--loss-seed", "4", "--duplicate", "0.1"}).code ==
            0);
    const json counts = place.report()["sending"]["datagrams"];
    CHECK(counts["sent"] == sink.datagrams().size());
    CHECK(counts["dropped_by_simulation"] > 0);
    CHECK(counts["offered"].get<int>() + counts["duplicated_by_simulation"].get<int>() ==
          counts["sent"].get<int>() + counts["dropped_by_simulation"].get<int>());
}

TEST_CASE("without vertices, all ellipsoids still come") {
    const Workplace place;
    UdpSink sink;
    REQUIRE(place.send(sink, {"--drop-vertices", "1"}).code == 0);
    const Heard all = heard(sink.datagrams());
    CHECK(all.vertex_sections == 0);
    CHECK(all.ellipsoids.size() == place.report()["models"][0]["ellipsoids"]);
}

TEST_CASE("a cached decomposition is the computed one, and makes the next start quick") {
    const Workplace place;
    const Arguments cache{"--cache", place.path("made/for/this").string()};
    std::set<std::string> ids;
    for (const bool cached : {false, true}) {
        UdpSink sink;
        REQUIRE(place.send(sink, cache).code == 0);
        const json model = place.report()["models"][0];
        CHECK(model["decomposition"]["cached"] == cached);
        CHECK(model["seconds"].contains("decompose") == !cached);
        ids.insert(model["object_id"].get<std::string>());
    }
    CHECK(ids.size() == 1);

    // A damaged file is computed anew, other options have a file of their own.
    for (const auto& entry : std::filesystem::directory_iterator(place.path("made/for/this"))) {
        std::filesystem::resize_file(entry.path(), entry.file_size() / 2);
    }
    UdpSink sink;
    REQUIRE(place.send(sink, cache).code == 0);
    const json repaired = place.report()["models"][0];
    CHECK(repaired["decomposition"]["cached"] == false);
    ids.insert(repaired["object_id"].get<std::string>());
    CHECK(ids.size() == 1);
    UdpSink other;
    REQUIRE(place.send(other, {cache[0], cache[1], "--seed", "5"}).code == 0);
    CHECK(place.report()["models"][0]["decomposition"]["cached"] == false);
}

TEST_CASE("a cache that cannot be used is a warning, not the end") {
    const Workplace place;
    place.write("file", "in the way");
    UdpSink sink;
    const Outcome outcome = place.send(sink, {"--cache", place.path("file/cache").string()});
    CHECK(outcome.code == 0);
    CHECK_THAT(outcome.err, Catch::Contains("cache") && Catch::Contains("warning"));
    CHECK_FALSE(sink.datagrams().empty());
    CHECK(place.report()["models"][0]["warnings"].size() == 1);
}

TEST_CASE("decomposing only writes the file and sends nothing") {
    const Workplace place;
    const Outcome outcome = run(
        quick({place.model().string(), "--decompose-only", place.path("ball.ellipsoids").string(),
               "--report", place.path("report.json").string()}));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(std::filesystem::file_size(place.path("ball.ellipsoids")) > std::uintmax_t{40} * 36);
    const json report = place.report();
    CHECK_FALSE(report.contains("sending"));
    CHECK(report["models"][0]["decomposition"]["candidates"] > 0);
}

TEST_CASE("several models are sent in turn, as objects of one stream") {
    const Workplace place;
    common::write_ply(place.path("ring.ply"), tests::torus(1.0, 0.4, 48, 24));
    UdpSink sink;
    const Outcome outcome = place.send(sink, {place.path("ring.ply").string(), "--rounds", "2"});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const Heard all = heard(sink.datagrams());
    CHECK(all.objects.size() == 2);
    CHECK(all.names == std::set<std::string>{"ball", "ring"});
    CHECK(place.report()["models"].size() == 2);
    CHECK(place.report()["sending"]["datagrams"]["sent"] == sink.datagrams().size());
}

TEST_CASE("a signal ends a carousel with a report and exit code 0") {
    const Workplace place;
    UdpSink sink;
    const int number = GENERATE(SIGINT, SIGTERM);
    Arguments arguments = quick({place.model().string(), "--to",
                                 "127.0.0.1:" + std::to_string(sink.port()), "--rounds", "forever",
                                 "--rate", "2M", "--report", place.path("report.json").string()});
    ChildProcess process(ELLICAST_SEND, arguments);
    REQUIRE(sink.await(50));
    process.send_signal(number);
    CHECK(process.wait(20s) == 0);
    const json report = place.report();
    CHECK(report["sending"]["interrupted"] == true);
    CHECK(report["sending"]["datagrams"]["sent"] == sink.datagrams().size());
    CHECK_FALSE(sink.datagrams().empty());
}

TEST_CASE("quiet means silent, and no run shows progress where no terminal is") {
    const Workplace place;
    UdpSink sink;
    const Outcome quiet = place.send(sink, {"--quiet"});
    CHECK(quiet.code == 0);
    CHECK(quiet.err.empty());
    CHECK(quiet.out.empty());
    UdpSink other;
    const Outcome loud = place.send(other, {"--log-level", "debug"});
    CHECK(loud.code == 0);
    CHECK(loud.err.find('\r') == std::string::npos);
    CHECK_THAT(loud.err, Catch::Contains("decompose took"));
}

TEST_CASE("a model that cannot be read ends in exit code 2 and one line that names it") {
    const Workplace place;
    const std::string ply = tests::read_file(place.model());
    place.write("empty.ply", "");
    place.write("truncated.ply", ply.substr(0, ply.size() / 2));
    place.write("text.ply", "this is no mesh\n");
    place.write("no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    place.write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    place.write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    place.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n");
    place.write("huge.off",
                "OFF\n4 4 0\n0 0 0\n1e300 0 0\n0 1e300 0\n0 0 1e300\n"
                "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    place.write("model.xyz", "1 2 3\n");
    std::filesystem::create_directory(place.path("directory.ply"));
    const std::string name =
        GENERATE("missing.ply", "empty.ply", "truncated.ply", "text.ply", "no_faces.obj", "nan.obj",
                 "range.obj", "flat.obj", "huge.off", "model.xyz", "directory.ply");
    CAPTURE(name);
    const Outcome outcome = run(quick({place.path(name).string(), "--to", "127.0.0.1"}));
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CAPTURE(outcome.err);
    CHECK(lines(outcome.err) == 1);
    CHECK_THAT(outcome.err, Catch::StartsWith("ellicast-send: ") && Catch::Contains(name));
}

TEST_CASE("an address, size or output that cannot be ends in exit code 2 before any work") {
    const Workplace place;
    const std::string model = place.model().string();
    const std::string nowhere = place.path("no/such/directory/file").string();
    const std::string directory = place.directory.path().string();
    const std::vector<std::pair<std::string, Arguments>> wrong{
        {"'no-such-host.invalid'", {model, "--to", "no-such-host.invalid"}},
        {"'h:70000'", {model, "--to", "h:70000"}},
        {"--datagram 65488", {model, "--to", "[::1]", "--datagram", "65507"}},
        {"--datagram", {model, "--to", "127.0.0.1", "--datagram", "100"}},
        {"--to", {model}},
        {"--frobnicate", {model, "--to", "127.0.0.1", "--frobnicate"}},
        {nowhere, {model, "--to", "127.0.0.1", "--report", nowhere}},
        {directory, {model, "--to", "127.0.0.1", "--report", directory}},
        {nowhere, {model, "--to", "127.0.0.1", "--sdp", nowhere}},
        {directory, {model, "--to", "127.0.0.1", "--sdp", directory}},
        {nowhere, {model, "--decompose-only", nowhere}},
        {"--loss", {model, "--to", "127.0.0.1", "--loss", "trace:" + nowhere}}};
    for (const auto& [named, arguments] : wrong) {
        const Outcome outcome = run(arguments);
        CAPTURE(named, outcome.err);
        CHECK(outcome.code == 2);
        CHECK(lines(outcome.err) == 1);
        CHECK_THAT(outcome.err, Catch::StartsWith("ellicast-send: ") && Catch::Contains(named));
    }
}
