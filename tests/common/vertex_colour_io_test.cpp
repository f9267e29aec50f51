// tests/common/vertex_colour_io_test.cpp: colours of vertices in model files.
#include <bit>
#include <catch2/catch.hpp>
#include <limits>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/meshes.hpp"

using namespace ellicast;
using namespace ellicast::common;

namespace {

using Colours = std::vector<Colour>;
const Colours kThree{{255, 0, 0}, {0, 128, 255}, {1, 2, 3}};

Colours in_ply(const std::string& columns, const std::string& vertices) {
    return parse_model(
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
               "property float y\nproperty float z\n" +
                   columns +
                   "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                   vertices + "3 0 1 2\n",
               ".ply")
        .colours;
}

std::string columns(const std::string& type, const std::string& prefix = "") {
    std::string text;
    for (const char* name : {"red", "green", "blue"}) {
        text += "property " + type + " " + prefix + name + "\n";
    }
    return text;
}

Colours in_off(const std::string& keyword, const std::string& vertices) {
    return parse_model(keyword + "\n3 1 0\n" + vertices + "3 0 1 2\n", ".off").colours;
}

Colours in_obj(const std::string& vertices) {
    return parse_model(vertices + "f 1 2 3\n", ".obj").colours;
}

template <class T>
std::string raw(T value) {
    const auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    return {bytes.data(), bytes.size()};
}

}  // namespace

TEST_CASE("a text PLY's colours are bytes or shares of one") {
    const std::string bytes = "0 0 0 255 0 0\n1 0 0 0 128 255\n0 1 0 1 2 3\n";
    CHECK(in_ply(columns("uchar"), bytes) == kThree);
    CHECK(in_ply(columns("uint8", "diffuse_"), bytes) == kThree);
    const std::string shares = "0 0 0 1 0 0\n1 0 0 0 0.50196 1.0\n0 1 0 0.0039 0.00785 0.01176\n";
    CHECK(in_ply(columns("float"), shares) == kThree);
    CHECK(in_ply(columns("double"), shares) == kThree);
}

TEST_CASE("a binary PLY's colours are bytes or shares of one, in both orders and with alpha") {
    const std::string header =
        "element vertex 3\nproperty uchar blue\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar alpha\nproperty uchar green\n"
        "element face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
    const std::string face{"\x03\x00\x01\x02", 4};
    std::string body;
    for (std::size_t v = 0; v < 3; ++v) {
        const Colour& c = kThree[v];
        body += raw(c[2]) + raw(std::uint32_t{0}) + raw(std::uint32_t{0}) + raw(std::uint32_t{0}) +
                raw(c[0]) + raw(std::uint8_t{77}) + raw(c[1]);
    }
    body[15 + 1 + 2] = body[30 + 5 + 2] = 1;  // other points, tiny in either order
    for (const char* order : {"little", "big"}) {
        const std::string text =
            std::string("ply\nformat binary_") + order + "_endian 1.0\n" + header + body + face;
        CHECK(parse_model(text, ".ply").colours == kThree);
    }
}

TEST_CASE("shares beyond their ends and those that are no number become ends") {
    const auto nan = std::to_string(std::numeric_limits<double>::quiet_NaN());
    CHECK(in_ply(columns("float"), "0 0 0 2 -1 " + nan + "\n1 0 0 1e30 0 1\n0 1 0 0 0 0\n") ==
          Colours{{255, 0, 0}, {255, 0, 255}, {0, 0, 0}});
    CHECK(in_ply(columns("uchar"), "0 0 0 256 -1 x\n1 0 0 7 8 9\n0 1 0 0 0 0\n") ==
          Colours{{255, 0, 0}, {7, 8, 9}, {0, 0, 0}});
}

TEST_CASE("PLY columns that are no three alike are no colours") {
    const std::string two = "property uchar red\nproperty uchar green\n";
    CHECK(in_ply(two, "0 0 0 1 2\n1 0 0 1 2\n0 1 0 1 2\n").empty());
    CHECK(in_ply(two + "property float blue\n", "0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n").empty());
    CHECK(in_ply(columns("short"), "0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n").empty());
    CHECK(in_ply(two + "property list uchar uchar blue\n",
                 "0 0 0 1 2 1 3\n1 0 0 1 2 0\n0 1 0 1 2 1 3\n")
              .empty());
}

TEST_CASE("an OFF's colours count where its keyword announces them") {
    const std::string bytes = "0 0 0 255 0 0 255\n1 0 0 0 128 255 255\n0 1 0 1 2 3 255\n";
    CHECK(in_off("COFF", bytes) == kThree);
    CHECK(in_off("OFF", bytes).empty());
    CHECK(in_off("COFF", "0 0 0 1 0 0\n1 0 0 0 .50196 1\n0 1 0 .0039 .00785 .01176\n") == kThree);
    CHECK(in_off("CNOFF", "0 0 0 0 0 1 255 0 0\n1 0 0 0 0 1 0 128 255\n0 1 0 0 0 1 1 2 3\n") ==
          kThree);
    CHECK(in_off("COFF", "0 0 0 255 0 0\n1 0 0 0 128\n0 1 0 1 2 3\n").empty());
    CHECK(in_off("COFF", "0 0 0 255 0 0\n1 0 0 0 x 255\n0 1 0 1 2 3\n").empty());
}

TEST_CASE("an OBJ's colours count where every vertex has three numbers more") {
    CHECK(in_obj("v 0 0 0 1 0 0\nv 1 0 0 0 0.50196 1\nv 0 1 0 0.0039 0.00785 0.01176\n") == kThree);
    CHECK(in_obj("v 0 0 0 255 0 0\nv 1 0 0 0 128 255\nv 0 1 0 1 2 3\n") == kThree);
    CHECK(in_obj("v 0 0 0 1 0 0\nv 1 0 0 1\nv 0 1 0 1 1 1\n").empty());
    CHECK(in_obj("v 0 0 0 1 0 0 1\nv 1 0 0 1 0 0 1\nv 0 1 0 1 1 1 1\n").empty());
    CHECK(in_obj("v 0 0 0 1 0 0\nv 1 0 0 1 inf 0\nv 0 1 0 1 1 1\n").empty());
}

TEST_CASE("an STL has no colours, and a plain PLY none") {
    const tests::TemporaryDirectory directory;
    TriangleMesh mesh = tests::cube();
    mesh.colours.assign(mesh.positions.size(), Colour{1, 2, 3});
    write_model(directory.path() / "a.stl", mesh);
    CHECK(read_model(directory.path() / "a.stl").colours.empty());
    mesh.colours.clear();
    write_model(directory.path() / "a.ply", mesh);
    CHECK(read_model(directory.path() / "a.ply").colours.empty());
}

TEST_CASE("a coloured mesh is written to PLY with its colours and read back") {
    const tests::TemporaryDirectory directory;
    TriangleMesh mesh = tests::icosphere(1);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        mesh.colours.push_back(
            {static_cast<std::uint8_t>(v), 200, static_cast<std::uint8_t>(6 * v)});
    }
    PlyOptions options;
    options.double_positions = GENERATE(false, true);
    options.properties = {{"quality", std::vector<float>(mesh.positions.size(), 0.5f)}};
    options.byte_properties = {{"guessed", std::vector<std::uint8_t>(mesh.positions.size(), 1)}};
    write_ply(directory.path() / "a.ply", mesh, options);
    const TriangleMesh read = read_model(directory.path() / "a.ply");
    CHECK(read.colours == mesh.colours);
    CHECK(read.triangles == mesh.triangles);
    const std::string bytes = tests::read_file(directory.path() / "a.ply");
    CHECK_THAT(bytes, Catch::Contains(" z\nproperty uchar red\nproperty uchar green\n"
                                      "property uchar blue\nproperty float quality\n"
                                      "property uchar guessed\nelement face 80\n"));
    const std::size_t each = (options.double_positions ? 24u : 12u) + 3 + 4 + 1;
    CHECK(bytes.size() == bytes.find("end_header\n") + 11 + 42 * each + 80 * 13);
}
