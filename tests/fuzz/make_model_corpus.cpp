// tests/fuzz/make_model_corpus.cpp: writes the seeds of corpus/model, the same at every run.
//     build/release/tests/fuzz/make_model_corpus tests/fuzz/corpus/model
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/meshes.hpp"
#include "tests/support/model_bytes.hpp"

namespace {

using namespace ellicast::tests;

// The byte before the file chooses the format: tests/fuzz/model_fuzz.cpp.
const std::string kPly(1, '\0');
const std::string kObj(1, '\1');
const std::string kOff(1, '\2');
const std::string kStl(1, '\3');

std::vector<std::pair<std::string, std::string>> seeds() {
    const auto mesh = icosphere(0);
    const std::string columns =
        "ply\r\nformat ascii 1.0\r\ncomment c\r\nelement camera 1\r\nproperty list uchar float "
        "v\r\n"
        "element vertex 4\r\nproperty uchar red\r\nproperty double z\r\nproperty int y\r\n"
        "property float x\r\nelement face 2\r\nproperty list uchar float texcoord\r\n"
        "property list uint uint vertex_index\r\nend_header\r\n"
        "2 0.5 1e-3\r\n9 1 0 0\r\n9 0 1 0\r\n9 0 0 1\r\n9 1 1 1.5\r\n"
        "2 0 1 3 0 1 2\r\n0 4 0 1 2 3\r\n";
    const std::string binary =
        "ply\nformat binary_big_endian 1.0\nelement face 1\nproperty uchar flag\n"
        "property list uchar uchar vertex_indices\nproperty list ushort char tag\n"
        "element vertex 3\nproperty short x\nproperty short y\nproperty short z\nend_header\n" +
        std::string("\7\3\2\1\0\0\2ab\0\1\0\2\0\3\0\4\0\5\0\6\0\7\0\0\xff\xff", 27);
    const std::string coloured =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty float red\nproperty float green\nproperty float blue\n"
        "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0 1 0 .5\n1 0 0 nan 2 -1\n0 1 0 x 0 0\n0 0 1 1 1 1e9\n"
        "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    return {
        {"ply-ascii", kPly + ply_bytes(mesh, PlyEncoding::ascii)},
        {"ply-little", kPly + ply_bytes(mesh, PlyEncoding::little_endian)},
        {"ply-big-double", kPly + ply_bytes(mesh, PlyEncoding::big_endian, true)},
        {"ply-columns", kPly + columns},
        {"ply-binary-lists", kPly + binary},
        {"ply-shares", kPly + coloured},
        {"obj", kObj + obj_text(mesh)},
        {"obj-corners",
         kObj + "mtllib /dev/zero\nv 0 0 0\nv 1 0 0 1\nv 0 1e0 0\nvn 0 0 1\nv 0 0 1 .5 .5 .5\n"
                "f 1/1 2//2 3/3/3 4 \nf -1 -2 \\\n -3 # back\n"},
        {"off", kOff + off_text(mesh)},
        {"off-colours", kOff + "STCNOFF # c\n4 2\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n"
                               "3 0 1 2 255 0 0\n4 0 1 3 2\n"},
        {"off-vertex-colours", kOff + "CNOFF\n4 4\n0 0 0 0 0 1 255 0 0 9\n1 0 0 0 0 1 0 1 2\n"
                                      "0 1 0 0 0 1 7 300 -1\n0 0 1 0 0 1 4 5 6\n"
                                      "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"},
        {"obj-colours", kObj + "v 0 0 0 1 0 0\nv 1 0 0 0 .5 0\nv 0 1 0 0 0 1\nv 0 0 1 1 1 1\n"
                               "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
        {"stl-binary", kStl + stl_binary(mesh)},
        {"stl-text", kStl + stl_text(mesh)},
        {"touching", kOff + off_text(edge_touching_itself())},
        {"moebius", kOff + off_text(moebius_strip(5))},
        {"degenerate", kOff + off_text(with_degenerates())},
        {"nested", kOff + off_text(join(cube(), cube(0.5)))},
    };
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: make_model_corpus FOLDER\n");
        return 2;
    }
    for (const auto& [name, bytes] : seeds()) {
        std::ofstream file(std::filesystem::path(argv[1]) / name, std::ios::binary);
        file << bytes;
        if (!file.flush()) {
            std::fprintf(stderr, "make_model_corpus: cannot write to %s\n", argv[1]);
            return 2;
        }
    }
    return 0;
}
