// receiver/output_files.cpp
#include "receiver/output_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "common/hex_text.hpp"
#include "common/model_io.hpp"
#include "receiver/vertex_colours.hpp"

namespace ellicast::receiver {
namespace {

namespace fs = std::filesystem;
using common::ModelError;

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
    throw ModelError("cannot write '" + path.string() + "': " + reason);
}

bool is_disliked(char c) {
    const auto code = static_cast<unsigned char>(c);
    return code < 0x20 || code == 0x7f || std::strchr("<>:\"|?*'`$&;!\\/ ", c) != nullptr;
}

bool continues_character(char c) {
    return (static_cast<unsigned char>(c) & 0xc0) == 0x80;
}

// A probe, because permissions, read-only mounts and full quotas have many forms and one test.
void probe_directory(const fs::path& directory, const fs::path& blamed) {
    std::string probe = (directory / ".ellicast-XXXXXX").string();
    const int fd = mkstemp(probe.data());
    if (fd < 0) fail(blamed, std::strerror(errno));
    close(fd);
    unlink(probe.c_str());
}

bool survives_float(double x) {
    return static_cast<double>(static_cast<float>(x)) == x;
}

// Received positions are float32 plus origin. Marching-cubes vertices are estimates; for them
// float32 is fine unless the model is small and far away.
bool needs_double(const Reconstruction& reconstruction) {
    const auto& positions = reconstruction.mesh.positions;
    for (std::size_t v = 0; v < positions.size(); ++v) {
        if (reconstruction.vertex_index[v] == kNotReceived) continue;
        for (const double x : positions[v]) {
            if (!survives_float(x)) return true;
        }
    }
    const Eigen::AlignedBox3d box = common::bounding_box(positions);
    if (box.isEmpty()) return false;
    const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
    return farthest > 64.0 * box.diagonal().norm();
}

common::PlyOptions ply_options(const Reconstruction& reconstruction, const ReceivedObject& object) {
    common::PlyOptions options;
    options.double_positions = needs_double(reconstruction);
    options.comment = "ellicast object " + id_text(object.id);
    return options;
}

void add_colours(const std::vector<common::Colour>& colours, common::PlyOptions& options) {
    if (colours.empty()) return;
    constexpr std::array<const char*, 3> kChannels{"red", "green", "blue"};
    for (std::size_t k = 0; k < kChannels.size(); ++k) {
        common::PlyByteProperty& property = options.byte_properties.emplace_back();
        property.name = kChannels[k];
        property.values.reserve(colours.size());
        for (const common::Colour& colour : colours) property.values.push_back(colour[k]);
    }
}

void add_confidence(const Reconstruction& reconstruction, common::PlyOptions& options) {
    const std::vector<Provenance>& provenance = reconstruction.provenance;
    const bool measured = std::all_of(provenance.begin(), provenance.end(),
                                      [](Provenance p) { return p == Provenance::received; });
    if (measured && reconstruction.summary.missing == 0) return;
    common::PlyByteProperty& property = options.byte_properties.emplace_back();
    property.name = "provenance";
    for (const Provenance p : provenance) property.values.push_back(static_cast<std::uint8_t>(p));
    options.properties.push_back({"distance_to_received", reconstruction.confidence.distance});
    options.properties.push_back({"confidence", reconstruction.confidence.completeness});
}

/// With what the result's vertices have beside positions.
common::PlyOptions result_options(const Reconstruction& reconstruction,
                                  const ReceivedObject& object) {
    common::PlyOptions options = ply_options(reconstruction, object);
    add_colours(vertex_colours(reconstruction, object), options);
    add_confidence(reconstruction, options);
    return options;
}

}  // namespace

std::string id_text(const protocol::ObjectId& id) {
    return common::hex_text(id);
}

std::string name_of(const ReceivedObject& object) {
    if (object.description && !object.description->name.empty()) return object.description->name;
    return id_text(object.id);
}

std::string safe_file_stem(std::string_view name, std::size_t most_bytes) {
    const std::size_t slash = name.find_last_of("/\\");
    if (slash != std::string_view::npos) name.remove_prefix(slash + 1);
    const std::size_t start = name.find_first_not_of(".- ");
    name.remove_prefix(std::min(start, name.size()));
    std::size_t length = std::min(name.size(), most_bytes);
    while (length < name.size() && length > 0 && continues_character(name[length])) --length;
    std::string stem(name.substr(0, length));
    std::replace_if(stem.begin(), stem.end(), is_disliked, '_');
    return stem;
}

bool names_directory(const fs::path& output) {
    std::error_code ignored;
    return !output.has_filename() || fs::is_directory(output, ignored);
}

fs::path output_file(const fs::path& output, const ReceivedObject& object, std::size_t most_bytes) {
    if (!names_directory(output)) return output;
    std::string stem = safe_file_stem(name_of(object), most_bytes);
    if (stem.empty()) stem = id_text(object.id);
    return output / (stem + ".ply");
}

void check_writable_file(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) fail(path, "is a directory");
    if (fs::exists(status) && access(path.c_str(), W_OK) != 0) fail(path, std::strerror(errno));
    if (fs::exists(status) && !fs::is_regular_file(status)) return;  // a device or pipe
    fs::path directory = path.parent_path();
    if (directory.empty()) directory = ".";
    probe_directory(directory, path);
}

void check_writable_directory(const fs::path& path) {
    std::error_code error;
    fs::create_directories(path, error);
    if (error) fail(path, error.message());
    probe_directory(path, path);
}

void write_mesh(const fs::path& path, const Reconstruction& reconstruction,
                const ReceivedObject& object) {
    common::write_ply(path, reconstruction.mesh, result_options(reconstruction, object));
}

void write_stages(const fs::path& directory, const Reconstruction& reconstruction,
                  const ReceivedObject& object) {
    assert(reconstruction.stages);
    const common::PlyOptions options = ply_options(reconstruction, object);
    const Stages& stages = *reconstruction.stages;
    common::write_ply(directory / "1-ellipsoids.ply", stages.ellipsoids, options);
    common::write_ply(directory / "2-marching-cubes.ply", stages.marching_cubes, options);
    common::write_ply(directory / "3-halfway.ply", stages.halfway, options);
    common::write_ply(directory / "4-final.ply", reconstruction.mesh,
                      result_options(reconstruction, object));
}

}  // namespace ellicast::receiver
