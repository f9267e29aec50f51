// tests/common/model_io_test.cpp
#include "common/model_io.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "common/random.hpp"
#include "tests/support/meshes.hpp"
#include "tests/support/model_bytes.hpp"

namespace ellicast::common {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using tests::obj_text;
using tests::off_text;
using tests::ply_bytes;
using tests::PlyEncoding;
using tests::stl_binary;
using tests::stl_text;

// A folder that goes away with the test.
class Folder {
  public:
    Folder() {
        std::string name = (fs::temp_directory_path() / "ellicast-model-io-XXXXXX").string();
        REQUIRE(::mkdtemp(name.data()) != nullptr);
        path_ = name;
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }
    [[nodiscard]] std::size_t entries() const {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator(path_), fs::directory_iterator()));
    }

  private:
    fs::path path_;
};

void put(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

std::string get(const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

bool same_bits(const Vector3d& a, const Vector3d& b) {
    return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

void check_same(const TriangleMesh& a, const TriangleMesh& b) {
    REQUIRE(a.positions.size() == b.positions.size());
    CHECK(std::equal(a.positions.begin(), a.positions.end(), b.positions.begin(), same_bits));
    CHECK(a.triangles == b.triangles);
}

TriangleMesh rounded_to_float(TriangleMesh mesh) {
    for (Vector3d& p : mesh.positions) p = p.cast<float>().cast<double>();
    return mesh;
}

// The reason why the bytes are refused; "" when they are not.
std::string refusal(const std::string& bytes, const std::string& extension) {
    try {
        parse_model(bytes, extension);
    } catch (const ModelError& error) {
        return error.what();
    }
    return "";
}

void check_refused(const std::string& bytes, const std::string& extension,
                   const std::string& reason) {
    INFO(bytes.substr(0, 200));
    const std::string said = refusal(bytes, extension);
    CHECK_THAT(said, Catch::Contains(reason));
    CHECK(said.find('\n') == said.npos);
}

std::string ply_header(const std::string& vertices, const std::string& faces,
                       const std::string& encoding = "ascii") {
    return "ply\nformat " + encoding + " 1.0\nelement vertex " + vertices +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
           "\nproperty list uchar int vertex_indices\nend_header\n";
}

const std::string kFourPoints = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";

TEST_CASE("every format brings back the mesh that was written") {
    const TriangleMesh mesh = rounded_to_float(tests::torus(1.0, 0.37, 9, 7));
    for (const PlyEncoding encoding :
         {PlyEncoding::ascii, PlyEncoding::little_endian, PlyEncoding::big_endian}) {
        check_same(parse_model(ply_bytes(mesh, encoding), ".ply"), mesh);
    }
    check_same(parse_model(obj_text(mesh), ".obj"), mesh);
    check_same(parse_model(off_text(mesh), ".off"), mesh);
    for (const std::string& bytes : {stl_text(mesh), stl_binary(mesh)}) {
        const TriangleMesh read = parse_model(bytes, ".stl");
        REQUIRE(read.positions.size() == mesh.positions.size());
        REQUIRE(read.triangles.size() == mesh.triangles.size());
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            for (std::size_t c = 0; c < 3; ++c) {
                CHECK(same_bits(read.positions[read.triangles[t][c]],
                                mesh.positions[mesh.triangles[t][c]]));
            }
        }
    }
}

TEST_CASE("float32 positions come through bit for bit") {
    const std::uint64_t seed = 7;
    INFO("seed " << seed);
    Random random(seed);
    TriangleMesh mesh;
    while (mesh.positions.size() < 3000) {
        Vector3d p;
        for (double& x : p) {
            float f = 0;
            do {
                f = std::bit_cast<float>(static_cast<std::uint32_t>(random.next()));
            } while (!(std::abs(f) <= std::numeric_limits<float>::max()));
            x = f;
        }
        mesh.positions.push_back(p);
    }
    mesh.positions[0] = Vector3d(0.0, -0.0, 0x1p-149);
    for (std::uint32_t i = 0; i + 2 < 3000; i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
    check_same(parse_model(ply_bytes(mesh, PlyEncoding::ascii), ".ply"), mesh);
    check_same(parse_model(ply_bytes(mesh, PlyEncoding::big_endian), ".ply"), mesh);
    check_same(parse_model(off_text(mesh), ".off"), mesh);
    check_same(parse_model(obj_text(mesh), ".obj"), mesh);

    const Folder folder;
    write_ply(folder / "a.ply", mesh);
    check_same(read_model(folder / "a.ply"), mesh);
    write_model(folder / "a.obj", mesh);
    check_same(rounded_to_float(read_model(folder / "a.obj")), mesh);
    write_model(folder / "a.off", mesh);
    check_same(rounded_to_float(read_model(folder / "a.off")), mesh);
}

TEST_CASE("positions keep the double that the file holds") {
    const TriangleMesh mesh =
        tests::translated(tests::icosphere(1), Vector3d(4.5e6 + 1e-4, -3.25e5, 1.0 / 3));
    for (const PlyEncoding encoding :
         {PlyEncoding::ascii, PlyEncoding::little_endian, PlyEncoding::big_endian}) {
        check_same(parse_model(ply_bytes(mesh, encoding, true), ".ply"), mesh);
    }
    check_same(parse_model(obj_text(mesh), ".obj"), mesh);
    check_same(parse_model(off_text(mesh), ".off"), mesh);
    const Folder folder;
    write_ply(folder / "d.ply", mesh, {.double_positions = true, .comment = "", .properties = {}});
    check_same(read_model(folder / "d.ply"), mesh);
}

TEST_CASE("polygons become fans of good shape, degenerate corners vanish") {
    // A dart: seen from corners 0 and 2 both triangles turn the right way, from 1 and 3 one does
    // not.
    const std::string dart = "v 0 0.4 0\nv -1 -1 0\nv 0 1 0\nv 1 -1 0\n";
    const TriangleMesh mesh = parse_model(dart + "f 2 1 4 3\n", ".obj");
    REQUIRE(mesh.triangles.size() == 2);
    for (const Triangle& t : mesh.triangles) {
        CHECK(std::find(t.begin(), t.end(), 0u) != t.end());
        CHECK(std::find(t.begin(), t.end(), 2u) != t.end());
        const Vector3d normal = (mesh.positions[t[1]] - mesh.positions[t[0]])
                                    .cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
        CHECK(normal.z() > 0);
    }
    const std::string square = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    CHECK(parse_model(square + "6 0 1 1 2 3 3\n2 0 1\n", ".off").triangles.size() == 2);
    check_refused(square + "3 0 1 1\n2 0 1\n", ".off", "no faces");

    std::string disc = "OFF\n2000 1 0\n";
    std::string corners = "2000";
    for (int i = 0; i < 2000; ++i) {
        disc += std::to_string(std::cos(i * 0.00314159)) + " " +
                std::to_string(std::sin(i * 0.00314159)) + " 0\n";
        corners += ' ';
        corners += std::to_string(i);
    }
    CHECK(parse_model(disc + corners + "\n", ".off").triangles.size() == 1998);
}

TEST_CASE("a non-manifold mesh is read as it is") {
    for (const TriangleMesh& mesh :
         {tests::edge_shared_by_four(), tests::vertex_shared_by_two(), tests::moebius_strip(9)}) {
        const TriangleMesh expected = rounded_to_float(mesh);
        check_same(parse_model(ply_bytes(expected, PlyEncoding::little_endian), ".ply"), expected);
        check_same(parse_model(obj_text(expected), ".obj"), expected);
        check_same(parse_model(off_text(expected), ".off"), expected);
    }
}

TEST_CASE("PLY columns, lists and elements that are not shape are stepped over") {
    const std::string header =
        "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info element face 99\r\n"
        "element camera 1\r\nproperty list uchar float view\r\nproperty int id\r\n"
        "element vertex 3\r\nproperty uchar red\r\nproperty double z\r\n"
        "property list int short near\r\nproperty int y\r\nproperty float x\r\n"
        "element face 2\r\nproperty list uchar float texcoord\r\n"
        "property list uint uint vertex_index\r\nproperty float quality\r\n"
        "element edge 1\r\nproperty int a\r\nproperty int b\r\nend_header\r\n";
    const std::string body =
        "2 0.5 0.25 7\r\n"
        "255 0.1 0 2 1.5\r\n1 0.2 1 8 9 4 2.5\r\n0 0.3 2 -3 5 -3 3.5\r\n"
        "6 0 0 0 1 1 1 3 0 1 2 0.75\r\n0 3 2 1 0 0.5\r\n0 1\r\n";
    check_refused(header + body, ".ply",
                  "line");  // vertex 1 lists 1, then reads 9 as y: 4 2.5 surplus
    std::string good = header + body;
    good.replace(good.find("1 0.2 1 8 9 4 2.5"), 17, "1 0.2 2 8 9 4 2.5");
    const TriangleMesh mesh = parse_model(good, ".ply");
    REQUIRE(mesh.positions.size() == 3);
    CHECK(mesh.positions[0] == Vector3d(1.5, 2, 0.1));
    CHECK(mesh.positions[1] == Vector3d(2.5, 4, 0.2));
    CHECK(mesh.positions[2] == Vector3d(3.5, -3, 0.3));
    CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {2, 1, 0}});

    // The same in binary: a colour that is a double, and faces before vertices.
    const auto f32 = [](float x) {
        return std::string(std::bit_cast<std::array<char, 4>>(x).data(), 4);
    };
    const std::string binary =
        "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty uchar flag\n"
        "property list uchar uchar vertex_indices\nproperty list ushort char tag\n"
        "element vertex 3\nproperty double red\nproperty float x\nproperty short y\n"
        "property float z\ncomment last\nend_header\n";
    const std::string face{"\x09\x03\x02\x01\x00\x02\x00\x55\x56", 9};
    std::string points;
    for (int i = 0; i < 3; ++i) {
        points += std::string(8, '\x7f') + f32(static_cast<float>(i)) +
                  std::string(i == 1 ? "\xfe\xff" : "\x01\x00", 2) + f32(0.5f);
    }
    const TriangleMesh other = parse_model(binary + face + points, ".ply");
    REQUIRE(other.positions.size() == 3);
    CHECK(other.positions[1] == Vector3d(1, -2, 0.5));
    CHECK(other.triangles == std::vector<Triangle>{{2, 1, 0}});
}

TEST_CASE("OBJ indices count back, carry slashes and reach ahead") {
    const TriangleMesh mesh = parse_model(
        "mtllib /dev/zero\nusemtl gold\nf 1/1 2//2 3/3/3 # ahead\nv 0 0 0 1.0\r\nv 1 0 0 1 0.5 0\n"
        "v 0 1 0\nvt 0 0\nvn 0 0 1\nv 0 0 1\ng side\nf -1 -2 \\\n -3\ns off\nl 1 2\nf 4 3 2 1",
        ".OBJ");
    REQUIRE(mesh.positions.size() == 4);
    REQUIRE(mesh.triangles.size() == 4);
    CHECK(mesh.triangles[0] == Triangle{0, 1, 2});
    CHECK(mesh.triangles[1] == Triangle{3, 2, 1});
}

TEST_CASE("OFF may carry comments, colours, normals and counts on the first line") {
    const std::vector<Triangle> expected{{0, 1, 2}, {1, 3, 2}};
    const std::string faces = "3 0 1 2 255 0 0\n# between\n3 1 3 2 # behind\n";
    for (const std::string& text :
         {"OFF 4 2 5\n" + kFourPoints + faces,
          "# above\nOFF\n\n# counts\n4 2 5\n" + kFourPoints + faces,
          "COFF\n4 2 5\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n0 0 1 1 0 0 1\n" + faces,
          "STCNOFF\n4 2\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n0 0 1 0 0 1\n" + faces}) {
        const TriangleMesh mesh = parse_model(text, ".off");
        CHECK(mesh.triangles == expected);
        REQUIRE(mesh.positions.size() == 4);
        CHECK(mesh.positions[3] == Vector3d(0, 0, 1));
    }
    check_refused("4OFF\n1 1 0\n", ".off", "three dimensions");
    check_refused("OFF BINARY\n1 1 0\n", ".off", "binary");
}

TEST_CASE("an STL's name and normals are not mistaken for geometry") {
    const std::string text =
        "solid outer loop facet normal\nFACET NORMAL nan nan nan\nouter loop\nvertex 0 0 0\n"
        "vertex 1 0 0 vertex 0 1e0 0\nendloop endfacet\nendsolid outer\nsolid two\n"
        "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 1 0 vertex 0 0 1 endloop endfacet\n"
        "endsolid";
    const TriangleMesh mesh = parse_model(text, ".stl");
    CHECK(mesh.positions.size() == 4);
    CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
    std::string binary = stl_binary(tests::cube());
    binary.replace(0, 5, "solid");
    CHECK(parse_model(binary, ".stl").positions.size() == 8);
}

TEST_CASE("a cut file is refused, wherever it is cut") {
    const TriangleMesh mesh = rounded_to_float(tests::icosphere(0));
    const auto check_prefixes = [](const std::string& bytes, const std::string& extension,
                                   std::size_t undetectable) {
        for (std::size_t n = 0; n + undetectable < bytes.size(); ++n) {
            INFO(extension << " cut to " << n << " of " << bytes.size());
            CHECK(!refusal(bytes.substr(0, n), extension).empty());
        }
        for (std::size_t n = bytes.size() - undetectable; n < bytes.size(); ++n) {
            refusal(bytes.substr(0, n), extension);  // either way, but in peace
        }
    };
    check_prefixes(ply_bytes(mesh, PlyEncoding::little_endian), ".ply", 0);
    check_prefixes(ply_bytes(mesh, PlyEncoding::big_endian, true), ".ply", 0);
    check_prefixes(stl_binary(mesh), ".stl", 0);
    // The last number may lose digits, the last line its newline. "endsolid thing\n" ends an STL
    // twice.
    check_prefixes(ply_bytes(mesh, PlyEncoding::ascii), ".ply", 2);
    check_prefixes(off_text(mesh), ".off", 2);
    check_prefixes(stl_text(mesh), ".stl", 7);

    // An OBJ has no counts: what is left must be a mesh in itself.
    const std::string obj = obj_text(mesh);
    for (std::size_t n = 0; n < obj.size(); ++n) {
        try {
            const TriangleMesh part = parse_model(obj.substr(0, n), ".obj");
            CHECK(part.triangles.size() <= mesh.triangles.size());
            for (const Triangle& t : part.triangles) {
                CHECK(*std::max_element(t.begin(), t.end()) < part.positions.size());
            }
        } catch (const ModelError&) {
        }
    }
    check_refused(obj.substr(0, obj.size() - 3), ".obj", "corners");
}

TEST_CASE("counts are believed only as far as the bytes go") {
    for (const std::string huge : {"4000000000", "2147483647", "99999999999999999999", "-1", "x"}) {
        for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
            CHECK(!refusal(ply_header(huge, "1", encoding) + kFourPoints, ".ply").empty());
            CHECK(!refusal(ply_header("4", huge, encoding) + kFourPoints, ".ply").empty());
        }
        CHECK(!refusal("OFF\n" + huge + " 1 0\n" + kFourPoints + "3 0 1 2\n", ".off").empty());
        CHECK(!refusal("OFF\n4 " + huge + " 0\n" + kFourPoints + "3 0 1 2\n", ".off").empty());
        CHECK(!refusal("OFF\n4 1 0\n" + kFourPoints + huge + " 0 1 2\n", ".off").empty());
        CHECK(!refusal(ply_header("4", "1") + kFourPoints + huge + " 0 1 2\n", ".ply").empty());
    }
    std::string stl = stl_binary(tests::cube());
    stl.replace(80, 4, "\xff\xff\xff\xff");
    check_refused(stl, ".stl", "4294967295");
    check_refused(ply_header("4000000000", "1"), ".ply", "line 3: impossible count");
    check_refused(ply_header("2000000000", "1"), ".ply", "truncated");
    // An element without properties takes no bytes, however many there are.
    std::string ply = ply_header("4", "1") + kFourPoints + "3 0 1 2\n";
    ply.insert(ply.find("element vertex"), "element ghost 2147483647\n");
    CHECK(parse_model(ply, ".ply").triangles.size() == 1);
    check_refused(ply_header("4", "1").substr(0, 60), ".ply", "no end");
    check_refused("ply\n" + std::string(100000, '\n'), ".ply", "no end");
    check_refused("ply\nformat ascii one\nend_header\n", ".ply", "version");
}

TEST_CASE("numbers that are none, not finite or out of range are refused") {
    for (const std::string bad : {"nan", "inf", "-INF", "1e39", "-1e400", "1..2", "0x10", "", "1e",
                                  "--1", "+", "+-1", "-+1", "1,5"}) {
        INFO(bad);
        CHECK(!refusal("v 0 0 " + bad + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ".obj").empty());
        CHECK(!refusal("OFF\n3 1 0\n0 0 " + bad + "\n1 0 0\n0 1 0\n3 0 1 2\n", ".off").empty());
        CHECK(!refusal(ply_header("3", "1") + "0 0 " + bad + "\n1 0 0\n0 1 0\n3 0 1 2\n", ".ply")
                   .empty());
        CHECK(!refusal("solid\nfacet normal 0 0 1 outer loop vertex 0 0 " + bad +
                           " vertex 1 0 0 vertex 0 1 0 endloop endfacet endsolid\n",
                       ".stl")
                   .empty());
    }
    for (const std::string fine :
         {"1e-400", "1e-46", "+1.5", ".5", "5.", "-0", "1E2", "0.00000000000000001"}) {
        INFO(fine);
        CHECK(refusal("v 0 0 " + fine + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ".obj") == "");
        CHECK(refusal("OFF\n3 1 0\n0 0 " + fine + "\n1 0 0\n0 1 0\n3 0 1 2\n", ".off") == "");
        CHECK(refusal(ply_header("3", "1") + "0 0 " + fine + "\n1 0 0\n0 1 0\n3 0 1 2\n", ".ply") ==
              "");
    }
    TriangleMesh bad = tests::cube();
    for (const double x : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
        bad.positions[3][1] = x;
        check_refused(ply_bytes(bad, PlyEncoding::little_endian), ".ply", "not finite");
        check_refused(ply_bytes(bad, PlyEncoding::big_endian, true), ".ply", "not finite");
        check_refused(stl_binary(bad), ".stl", "not finite");
    }
}

TEST_CASE("an index that points nowhere is refused") {
    for (const std::string bad : {"4", "-1", "4294967295", "4294967296", "1.5"}) {
        INFO(bad);
        CHECK(!refusal("OFF\n4 1 0\n" + kFourPoints + "3 0 1 " + bad + "\n", ".off").empty());
        CHECK(!refusal(ply_header("4", "1") + kFourPoints + "3 0 1 " + bad + "\n", ".ply").empty());
    }
    const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (const std::string bad :
         {"0", "4", "-4", "4294967297", "1/", "1/2/3/4", "/1", "1//", "a", "1.0"}) {
        INFO(bad);
        CHECK(!refusal(points + "f 1 2 " + bad + "\n", ".obj").empty());
    }
    check_refused(points + "f 1 2\n", ".obj", "line 4");
    TriangleMesh mesh = tests::cube();
    mesh.triangles[5][1] = 8;
    check_refused(ply_bytes(mesh, PlyEncoding::little_endian), ".ply", "face 5: index 8");
    check_refused(ply_bytes(mesh, PlyEncoding::big_endian), ".ply", "face 5: index 8");
}

TEST_CASE("a file that is no mesh says why in one line with its path") {
    const Folder folder;
    const auto said = [&](const std::string& name) -> std::string {
        try {
            read_model(folder / name);
        } catch (const ModelError& error) {
            CHECK_THAT(error.what(), Catch::StartsWith((folder / name).parent_path().string()));
            CHECK(std::string(error.what()).find('\n') == std::string::npos);
            return error.what();
        }
        return "";
    };
    CHECK_THAT(said("missing.ply"), Catch::EndsWith("missing.ply: no such file"));
    for (const std::string extension : {".ply", ".obj", ".off", ".stl"}) {
        put(folder / ("empty" + extension), "");
        CHECK_THAT(said("empty" + extension), Catch::EndsWith(": empty"));
        put(folder / ("noise" + extension), "\x01\xff no mesh at all\n\n\n");
        CHECK(!said("noise" + extension).empty());
        fs::create_directory(folder / ("folder" + extension));
        CHECK_THAT(said("folder" + extension), Catch::EndsWith("is a directory"));
    }
    put(folder / "mesh.txt", obj_text(tests::cube()));
    CHECK_THAT(said("mesh.txt"), Catch::Contains("not a .ply, .obj, .off or .stl file"));
    put(folder / "plain", obj_text(tests::cube()));
    CHECK(!said("plain").empty());
    put(folder / "a\nb.ply", "");
    CHECK_THAT(said("a\nb.ply"), Catch::EndsWith("a?b.ply: empty"));
    REQUIRE(::mkfifo((folder / "pipe.ply").c_str(), 0600) == 0);
    CHECK_THAT(said("pipe.ply"), Catch::EndsWith("not a regular file"));
    check_refused("v 0 0 0\nv 1 0 0\nv 0 1 0\n", ".obj", "no faces");
    check_refused(ply_header("3", "0") + kFourPoints, ".ply", "no faces");
    check_refused(stl_binary({}), ".stl", "no faces");
    put(folder / "locked.ply", ply_bytes(tests::cube(), PlyEncoding::ascii));
    fs::permissions(folder / "locked.ply", fs::perms::none);
    if (::geteuid() != 0) CHECK_THAT(said("locked.ply"), Catch::Contains("ermission"));
    put(folder / "Cube.PlY", ply_bytes(tests::cube(), PlyEncoding::ascii));
    CHECK(read_model(folder / "Cube.PlY").triangles.size() == 12);
}

TEST_CASE("random damage never harms the reader") {
    const TriangleMesh mesh = tests::icosphere(0);
    const std::array<std::pair<std::string, std::string>, 7> files{{
        {ply_bytes(mesh, PlyEncoding::ascii), ".ply"},
        {ply_bytes(mesh, PlyEncoding::little_endian), ".ply"},
        {ply_bytes(mesh, PlyEncoding::big_endian, true), ".ply"},
        {obj_text(mesh), ".obj"},
        {off_text(mesh), ".off"},
        {stl_text(mesh), ".stl"},
        {stl_binary(mesh), ".stl"},
    }};
    const std::uint64_t seed = 2024;
    INFO("seed " << seed);
    Random random(seed);
    int read = 0;
    for (int run = 0; run < 4000; ++run) {
        auto [bytes, extension] = files[random.below(files.size())];
        for (std::size_t n = 1 + random.below(3); n > 0; --n) {
            const std::size_t at = random.below(bytes.size());
            switch (random.below(3)) {
                case 0:
                    bytes[at] = static_cast<char>(random.next());
                    break;
                case 1:
                    bytes.erase(at, 1 + random.below(8));
                    break;
                default:
                    bytes.insert(at, bytes.substr(random.below(bytes.size()), random.below(20)));
            }
            if (bytes.empty()) bytes.assign(1, '\n');
        }
        const std::string reason = refusal(bytes, extension);
        CHECK_THAT(reason, !Catch::Contains("reads it otherwise"));  // two readers, one opinion
        if (reason.empty()) ++read;
    }
    CHECK(read > 100);
}

TEST_CASE("a written PLY has its columns, its comment and always the same bytes") {
    const Folder folder;
    const TriangleMesh mesh = rounded_to_float(tests::icosphere(1));
    PlyOptions options;
    options.comment = "one\nline";
    options.properties = {{"confidence", std::vector<float>(mesh.positions.size(), 0.25f)},
                          {"index", std::vector<float>(mesh.positions.size(), 3.0f)}};
    write_ply(folder / "a.ply", mesh, options);
    write_ply(folder / "b.ply", mesh, options);
    const std::string bytes = get(folder / "a.ply");
    CHECK(bytes == get(folder / "b.ply"));
    CHECK_THAT(bytes, Catch::Contains("comment one line\n"));
    CHECK_THAT(bytes, Catch::Contains("property float z\nproperty float confidence\n"
                                      "property float index\nelement face 80\n"));
    CHECK(bytes.size() == bytes.find("end_header\n") + 11 + 42 * 20 + 80 * 13);
    check_same(read_model(folder / "a.ply"), mesh);
    write_ply(folder / "c.ply", mesh);
    CHECK(get(folder / "c.ply") == ply_bytes(mesh, PlyEncoding::little_endian));
}

TEST_CASE("every format is written by extension") {
    const Folder folder;
    const TriangleMesh mesh = rounded_to_float(tests::torus(3, 1.1, 8, 6));
    for (const std::string name : {"a.ply", "a.obj", "a.OFF"}) {
        write_model(folder / name, mesh);
        check_same(rounded_to_float(read_model(folder / name)), mesh);
    }
    write_model(folder / "a.stl", mesh);
    CHECK(fs::file_size(folder / "a.stl") == 84 + 50 * mesh.triangles.size());
    CHECK(read_model(folder / "a.stl").positions.size() == mesh.positions.size());
    CHECK_THROWS_AS(write_model(folder / "a.txt", mesh), ModelError);
    CHECK(folder.entries() == 4);
}

TEST_CASE("a failed write leaves the old file and nothing else") {
    const Folder folder;
    const TriangleMesh mesh = tests::cube();
    write_ply(folder / "kept.ply", mesh);
    const std::string before = get(folder / "kept.ply");
    TriangleMesh bad = mesh;
    bad.positions[0][0] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(write_ply(folder / "kept.ply", bad),
                      Catch::Contains("vertex 0 is not finite"));
    bad.positions[0][0] = 1e39;
    CHECK_THROWS_AS(write_model(folder / "kept.ply", bad), ModelError);
    CHECK(get(folder / "kept.ply") == before);
    CHECK_THROWS_WITH(write_ply(folder / "no" / "such.ply", mesh), Catch::Contains("such.ply: "));
    CHECK_THROWS_WITH(write_ply(folder / "", mesh), Catch::Contains("directory"));
    if (fs::exists("/dev/full")) CHECK_THROWS_AS(write_ply("/dev/full", mesh), ModelError);
    CHECK(folder.entries() == 1);
}

TEST_CASE("a disk that fills up while writing leaves the old file and no temporary") {
    const Folder folder;
    write_ply(folder / "kept.ply", tests::cube());
    const std::string before = get(folder / "kept.ply");
    // A limit on the size of files stands in for the disk.
    struct rlimit old {};
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &old) == 0);
    struct rlimit low = old;
    low.rlim_cur = 4096;
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &low) == 0);
    std::string said;
    try {
        write_ply(folder / "kept.ply", tests::icosphere(4));
    } catch (const ModelError& error) {
        said = error.what();
    }
    ::setrlimit(RLIMIT_FSIZE, &old);
    std::signal(SIGXFSZ, handler);
    CHECK_THAT(said, Catch::Contains("kept.ply: cannot be written: "));
    CHECK(get(folder / "kept.ply") == before);
    CHECK(folder.entries() == 1);
}

TEST_CASE("writing through a link keeps the link") {
    const Folder folder;
    write_ply(folder / "real.ply", tests::cube());
    fs::create_symlink("real.ply", folder / "link.ply");
    write_ply(folder / "link.ply", tests::icosphere(0));
    CHECK(fs::is_symlink(folder / "link.ply"));
    CHECK(read_model(folder / "real.ply").positions.size() == 12);
}

TEST_CASE("the reference models are read whole and written back bit for bit") {
    const auto models = tests::models_dir();
    if (!models) {
        WARN("no reference models: set ELLICAST_MODELS; skipped");
        return;
    }
    const std::array<std::pair<const char*, std::size_t>, 6> expected{{{"horse", 48485},
                                                                       {"stanford-bunny", 34834},
                                                                       {"rocker-arm", 10044},
                                                                       {"spot", 2930},
                                                                       {"fertility", 4494},
                                                                       {"homer", 6002}}};
    const Folder folder;
    for (const auto& [name, vertices] : expected) {
        INFO(name);
        const fs::path path = *models / (std::string(name) + ".ply");
        const TriangleMesh mesh = read_model(path);
        CHECK(mesh.positions.size() == vertices);
        write_ply(folder / "copy.ply", mesh);
        CHECK(get(folder / "copy.ply") == get(path));
    }
}

}  // namespace
}  // namespace ellicast::common
