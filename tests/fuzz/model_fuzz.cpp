// tests/fuzz/model_fuzz.cpp: the readers of users' files, and the preparation of what they accept.
// The first byte chooses the format, the rest is the file.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "common/mesh_topology.hpp"
#include "common/model_io.hpp"
#include "sender/model_preparation.hpp"

namespace {

using ellicast::common::TriangleMesh;

[[noreturn]] void fail(const char* promise) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}

void check_prepared(const TriangleMesh& mesh) {
    try {
        const ellicast::sender::PreparedModel model = ellicast::sender::prepare_model(mesh);
        const ellicast::common::MeshTopology topology =
            ellicast::common::analyse_topology(model.solid);
        if (!topology.closed || !topology.manifold) fail("a solid is a closed manifold");
        for (const ellicast::common::Triangle& face : model.faces) {
            for (const std::uint32_t v : face) {
                if (v >= model.vertices.size()) fail("faces are of the user's vertices");
            }
        }
        if (model.colours.size() != (mesh.colours.empty() ? 0 : model.vertices.size())) {
            fail("every vertex keeps its colour");
        }
        for (const Eigen::Vector3d& p : model.solid.positions) {
            if (!p.allFinite()) fail("a solid is finite");
        }
    } catch (const std::invalid_argument&) {
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static constexpr std::array<const char*, 4> kExtensions{".ply", ".obj", ".off", ".stl"};
    if (size == 0) return 0;
    std::string bytes(size - 1, '\0');
    if (size > 1) std::memcpy(bytes.data(), data + 1, size - 1);
    try {
        const TriangleMesh mesh =
            ellicast::common::parse_model(std::move(bytes), kExtensions[data[0] % 4]);
        if (mesh.triangles.empty()) fail("a model has faces");
        for (const Eigen::Vector3d& p : mesh.positions) {
            if (!p.allFinite()) fail("coordinates are finite");
        }
        for (const ellicast::common::Triangle& triangle : mesh.triangles) {
            for (const std::uint32_t v : triangle) {
                if (v >= mesh.positions.size()) fail("indices are in range");
            }
        }
        if (!mesh.colours.empty() && mesh.colours.size() != mesh.positions.size()) {
            fail("all vertices have colours or none");
        }
        check_prepared(mesh);
    } catch (const ellicast::common::ModelError& error) {
        if (std::strchr(error.what(), '\n') != nullptr) fail("a reason is one line");
        if (std::strstr(error.what(), "reads it otherwise") != nullptr) fail("two readers agree");
    }
    return 0;
}
