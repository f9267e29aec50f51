// common/ply_header.hpp: private to common/model_file_ply.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ellicast::common {

enum class PlyEncoding { ascii, little_endian, big_endian };
enum class PlyScalar { i8, u8, i16, u16, i32, u32, f32, f64 };

bool is_real(PlyScalar type);
std::size_t size_of(PlyScalar type);

struct PlyProperty {
    std::string name;
    PlyScalar type = PlyScalar::f32;
    std::optional<PlyScalar> count;  // of a list
};

struct PlyElement {
    std::string name;
    std::uint64_t entries = 0;
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<PlyElement> elements;
    std::size_t body = 0;     // offset of the first byte behind it
    std::size_t lines = 0;    // in it
    bool only_layout = true;  // no comments, no carriage returns
};

/// Parses the header at the start of the file. Counts are below 2^31 and not yet held against the
/// file. Throws BadModelFile (common/model_file_check.hpp).
PlyHeader parse_ply_header(std::string_view bytes);

inline constexpr std::size_t kNoColumn = std::numeric_limits<std::size_t>::max();

/// Where the shape is. Points into the header.
struct PlyLayout {
    const PlyElement* vertex = nullptr;
    const PlyElement* face = nullptr;
    std::array<std::size_t, 3> coordinate{kNoColumn, kNoColumn, kNoColumn};  // columns of x, y, z
    /// Columns of red, green, blue: all u8, all f32 or all f64; kNoColumn where not all are there.
    std::array<std::size_t, 3> colour{kNoColumn, kNoColumn, kNoColumn};
    std::size_t indices = kNoColumn;  // column of the face
    bool float32 = true;              // all coordinates
    bool plain = false;               // OpenMesh can read the file as it is
};

/// Throws BadModelFile when there is no vertex, no face, or not one x, y, z and list of indices.
PlyLayout find_ply_layout(const PlyHeader& header);

}  // namespace ellicast::common
