// common/model_io.cpp
#include "common/model_io.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <new>
#include <optional>
#include <system_error>
#include <utility>

#include "common/atomic_file.hpp"
#include "common/model_file_check.hpp"
#include "common/model_file_text.hpp"
#include "common/openmesh_io.hpp"
#include "common/polygon_soup.hpp"

namespace ellicast::common {
namespace {

namespace fs = std::filesystem;

// Room for any mesh with 32-bit indices in the formats' usual layouts; keeps a sparse file of a
// terabyte from being read.
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 32;

std::optional<ModelFormat> format_of(const std::string& extension) {
    static constexpr std::array<std::pair<const char*, ModelFormat>, 4> kFormats{{
        {".ply", ModelFormat::ply},
        {".obj", ModelFormat::obj},
        {".off", ModelFormat::off},
        {".stl", ModelFormat::stl},
    }};
    for (const auto& [name, format] : kFormats) {
        if (same_word(extension, name)) return format;
    }
    return std::nullopt;
}

ModelFormat require_format(const std::string& extension) {
    const std::optional<ModelFormat> format = format_of(extension);
    if (!format) throw BadModelFile("not a .ply, .obj, .off or .stl file");
    return *format;
}

TriangleMesh parse(std::string bytes, ModelFormat format) {
    PlainModelFile file = check_model_file(std::move(bytes), format);
    std::vector<Colour> colours = std::move(file.colours);
    TriangleMesh mesh = triangulate(read_through_openmesh(std::move(file), format));
    mesh.colours = std::move(colours);
    if (mesh.triangles.empty()) throw BadModelFile("no faces (all are degenerate)");
    return mesh;
}

std::string read_bytes(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found) throw BadModelFile("no such file");
    if (error) throw BadModelFile(error.message());
    if (fs::is_directory(status)) throw BadModelFile("is a directory");
    if (!fs::is_regular_file(status)) throw BadModelFile("not a regular file");
    const std::uintmax_t size = fs::file_size(path, error);
    if (error) throw BadModelFile(error.message());
    if (size > kMaxFileBytes) throw BadModelFile("larger than 4 GiB");

    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw BadModelFile(std::generic_category().message(errno));
    std::string bytes(static_cast<std::size_t>(size), '\0');
    stream.read(bytes.data(), static_cast<std::streamsize>(size));
    if (stream.bad()) throw BadModelFile("cannot be read");
    bytes.resize(static_cast<std::size_t>(stream.gcount()));
    return bytes;
}

// The path as one printable line.
std::string shown(const fs::path& path) {
    std::string text = path.string();
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
    return text;
}

// Runs `action`; whatever can go wrong with a user's file becomes a ModelError about `path`.
template <class Action>
auto naming(const fs::path& path, const Action& action) {
    try {
        return action();
    } catch (const BadModelFile& reason) {
        throw ModelError(shown(path) + ": " + reason.what());
    } catch (const WriteFailure& reason) {
        throw ModelError(shown(path) + ": cannot be written: " + reason.what());
    } catch (const std::bad_alloc&) {
        throw ModelError(shown(path) + ": not enough memory");
    }
}

// Builds a little-endian file.
class LittleEndian {
  public:
    explicit LittleEndian(std::string header) : bytes_(std::move(header)) {}

    void reserve(std::size_t more) { bytes_.reserve(bytes_.size() + more); }
    void u8(std::uint8_t value) { bytes_ += static_cast<char>(value); }
    void u32(std::uint32_t value) { put(value, 4); }
    void f32(float value) { put(std::bit_cast<std::uint32_t>(value), 4); }
    void f64(double value) { put(std::bit_cast<std::uint64_t>(value), 8); }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

  private:
    void put(std::uint64_t value, int size) {
        std::array<char, 8> raw{};
        for (std::size_t i = 0; i < 8; ++i) raw[i] = static_cast<char>(value >> (8 * i) & 0xff);
        bytes_.append(raw.data(), static_cast<std::size_t>(size));
    }
    std::string bytes_;
};

std::string ply_header(const TriangleMesh& mesh, const PlyOptions& options) {
    std::string comment = options.comment;
    std::replace_if(
        comment.begin(), comment.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    const std::string type = options.double_positions ? "double" : "float";
    std::string header = "ply\nformat binary_little_endian 1.0\n";
    if (!comment.empty()) header += "comment " + comment + "\n";
    header += "element vertex " + std::to_string(mesh.positions.size()) + "\n";
    for (const char* axis : {"x", "y", "z"}) header += "property " + type + " " + axis + "\n";
    if (!mesh.colours.empty()) {
        for (const char* channel : {"red", "green", "blue"}) {
            header += std::string("property uchar ") + channel + "\n";
        }
    }
    for (const PlyVertexProperty& property : options.properties) {
        header += "property float " + property.name + "\n";
    }
    for (const PlyByteProperty& property : options.byte_properties) {
        header += "property uchar " + property.name + "\n";
    }
    return header + "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
}

void require_finite(const TriangleMesh& mesh, bool as_double) {
    const double largest =
        as_double ? std::numeric_limits<double>::max() : std::numeric_limits<float>::max();
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        for (const double x : mesh.positions[i]) {
            if (std::abs(x) <= largest) continue;
            throw BadModelFile("vertex " + std::to_string(i) + " is not finite");
        }
    }
}

std::string ply_bytes(const TriangleMesh& mesh, const PlyOptions& options) {
    require_finite(mesh, options.double_positions);
    LittleEndian file(ply_header(mesh, options));
    const std::size_t vertex_size = (options.double_positions ? 24u : 12u) +
                                    (mesh.colours.empty() ? 0u : 3u) +
                                    4 * options.properties.size() + options.byte_properties.size();
    assert(mesh.colours.empty() || mesh.colours.size() == mesh.positions.size());
    file.reserve(vertex_size * mesh.positions.size() + 13 * mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        for (const double x : mesh.positions[i]) {
            options.double_positions ? file.f64(x) : file.f32(static_cast<float>(x));
        }
        if (!mesh.colours.empty()) {
            for (const std::uint8_t channel : mesh.colours[i]) file.u8(channel);
        }
        for (const PlyVertexProperty& property : options.properties) {
            assert(property.values.size() == mesh.positions.size());
            file.f32(property.values[i]);
        }
        for (const PlyByteProperty& property : options.byte_properties) {
            assert(property.values.size() == mesh.positions.size());
            file.u8(property.values[i]);
        }
    }
    for (const Triangle& triangle : mesh.triangles) {
        file.u8(3);
        for (const std::uint32_t corner : triangle) file.u32(corner);
    }
    return file.bytes();
}

}  // namespace

TriangleMesh read_model(const fs::path& path) {
    return naming(path, [&] {
        const ModelFormat format = require_format(path.extension().string());
        return parse(read_bytes(path), format);
    });
}

TriangleMesh parse_model(std::string bytes, const std::string& extension) {
    try {
        return parse(std::move(bytes), require_format(extension));
    } catch (const BadModelFile& reason) {
        throw ModelError(reason.what());
    } catch (const std::bad_alloc&) {
        throw ModelError("not enough memory");
    }
}

void write_ply(const fs::path& path, const TriangleMesh& mesh, const PlyOptions& options) {
    naming(path, [&] { write_file_atomically(path, ply_bytes(mesh, options)); });
}

void write_model(const fs::path& path, const TriangleMesh& mesh) {
    naming(path, [&] {
        const ModelFormat format = require_format(path.extension().string());
        if (format == ModelFormat::ply) {
            write_file_atomically(path, ply_bytes(mesh, {}));
        } else {
            require_finite(mesh, false);
            write_file_atomically(path, write_through_openmesh(mesh, format));
        }
    });
}

}  // namespace ellicast::common
