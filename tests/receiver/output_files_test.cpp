// tests/receiver/output_files_test.cpp
#include "receiver/output_files.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
namespace fs = std::filesystem;

namespace {

// The unit sphere received whole, as a mesh around `origin`.
struct Received {
    explicit Received(const Eigen::Vector3d& origin) {
        reconstruction.mesh = tests::icosphere(2);
        auto& positions = reconstruction.mesh.positions;
        for (std::size_t v = 0; v < positions.size(); ++v) {
            positions[v] = positions[v].cast<float>().cast<double>() + origin;
            reconstruction.vertex_index.push_back(static_cast<std::uint32_t>(v));
        }
        object.id = {0xab, 1, 2, 3, 4, 5, 6, 0xff};
    }
    Reconstruction reconstruction;
    ReceivedObject object;
};

std::size_t files_in(const fs::path& directory) {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(directory), fs::directory_iterator()));
}

}  // namespace

TEST_CASE("a stranger's name becomes a harmless file name") {
    CHECK(safe_file_stem("bunny") == "bunny");
    CHECK(safe_file_stem("Stanford.bunny-2") == "Stanford.bunny-2");
    CHECK(safe_file_stem("../../etc/passwd") == "passwd");
    CHECK(safe_file_stem("C:\\models\\horse") == "horse");
    CHECK(safe_file_stem("...hidden") == "hidden");
    CHECK(safe_file_stem("-rf") == "rf");
    CHECK(safe_file_stem("a b*c?d\"e\nf|g") == "a_b_c_d_e_f_g");
    CHECK(safe_file_stem("hästchen") == "hästchen");
    CHECK(safe_file_stem("..") == "");
    CHECK(safe_file_stem("/") == "");
    CHECK(safe_file_stem("") == "");
}

TEST_CASE("a long name is cut between characters") {
    CHECK(safe_file_stem(std::string(300, 'x')) == std::string(100, 'x'));
    std::string umlauts = "x";
    for (int k = 0; k < 60; ++k) umlauts += "ä";  // two bytes each, astride byte 100
    CHECK(safe_file_stem(umlauts).size() == 99);
}

TEST_CASE("a directory gets a file named after the model, or after the id") {
    const tests::TemporaryDirectory directory;
    ReceivedObject object;
    object.id = {0xab, 1, 2, 3, 4, 5, 6, 0xff};
    CHECK(output_file(directory.path(), object) == directory.path() / "ab010203040506ff.ply");
    CHECK(output_file("new/", object) == fs::path("new") / "ab010203040506ff.ply");
    object.description.emplace().name = "horse";
    CHECK(output_file(directory.path(), object) == directory.path() / "horse.ply");
    CHECK(output_file("mine.ply", object) == "mine.ply");
    object.description->name = "../..";
    CHECK(output_file("new/", object) == fs::path("new") / "ab010203040506ff.ply");
}

TEST_CASE("asking whether a file can be written leaves everything as it was") {
    const tests::TemporaryDirectory directory;
    const fs::path old = directory.path() / "old.ply";
    std::ofstream(old) << "precious";
    check_writable_file(old);
    check_writable_file(directory.path() / "new.ply");
    CHECK(tests::read_file(old) == "precious");
    CHECK(files_in(directory.path()) == 1);
    check_writable_file("/dev/null");
    CHECK_THROWS_AS(check_writable_file(directory.path()), common::ModelError);
    CHECK_THROWS_AS(check_writable_file(directory.path() / "no" / "x"), common::ModelError);
    CHECK_THROWS_AS(check_writable_directory(old), common::ModelError);
    check_writable_directory(directory.path() / "a" / "b");
    CHECK(fs::is_directory(directory.path() / "a" / "b"));
}

TEST_CASE("received vertices are written bit for bit, in float32 where that suffices") {
    const tests::TemporaryDirectory directory;
    const fs::path path = directory.path() / "x.ply";
    const Eigen::Vector3d origin = GENERATE(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4e6, 0, 0.1));
    const Received received(origin);
    write_mesh(path, received.reconstruction, received.object);
    const std::string header = tests::read_file(path).substr(0, 300);
    CHECK((header.find("double x") != std::string::npos) == (origin[0] != 0));
    CHECK(header.find("ab010203040506ff") != std::string::npos);
    CHECK(common::read_model(path).positions == received.reconstruction.mesh.positions);
}

TEST_CASE("estimated vertices alone need double only far from the origin") {
    const tests::TemporaryDirectory directory;
    const fs::path path = directory.path() / "x.ply";
    const double far = GENERATE(1.0 / 3, 1e5);
    Received received(Eigen::Vector3d(far, 0, 0));
    std::fill(received.reconstruction.vertex_index.begin(),
              received.reconstruction.vertex_index.end(), kNotReceived);
    write_mesh(path, received.reconstruction, received.object);
    const std::string header = tests::read_file(path).substr(0, 300);
    CHECK((header.find("double x") != std::string::npos) == (far > 1));
}

TEST_CASE("the file says what is measured and what is guessed, unless all is measured") {
    const tests::TemporaryDirectory directory;
    const fs::path path = directory.path() / "x.ply";
    Received received(Eigen::Vector3d::Zero());
    Reconstruction& reconstruction = received.reconstruction;
    const std::size_t n = reconstruction.mesh.positions.size();
    reconstruction.provenance.assign(n, Provenance::received);
    reconstruction.confidence.distance.assign(n, 0.5F);
    reconstruction.confidence.completeness.assign(n, 0.25F);
    const auto header = [&] {
        write_mesh(path, reconstruction, received.object);
        const std::string bytes = tests::read_file(path);
        return bytes.substr(0, bytes.find("end_header"));
    };
    const auto marked = [](const std::string& text) {
        return text.find("property uchar provenance\n") != std::string::npos &&
               text.find("property float distance_to_received\n") != std::string::npos &&
               text.find("property float confidence\n") != std::string::npos;
    };
    CHECK(header().find("provenance") == std::string::npos);
    CHECK(header().find("confidence") == std::string::npos);
    reconstruction.summary.missing = 1;
    CHECK(marked(header()));
    reconstruction.summary.missing = 0;
    reconstruction.provenance[3] = Provenance::coarse;
    CHECK(marked(header()));
    CHECK(common::read_model(path).positions == reconstruction.mesh.positions);
    // The last vertex: 3 floats, 2 floats, the byte.
    reconstruction.provenance[n - 1] = Provenance::concealed;
    const std::size_t body = header().size() + std::string("end_header\n").size();
    const std::string bytes = tests::read_file(path);
    CHECK(bytes.at(body + 21 * n - 1) == 1);
    CHECK(bytes.at(body + 21 * 4 - 1) == 2);
    CHECK(bytes.at(body + 21 * 5 - 1) == 0);
}
