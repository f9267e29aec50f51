// common/model_file_ply.cpp
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/file_colours.hpp"
#include "common/model_file_check.hpp"
#include "common/model_file_text.hpp"
#include "common/number_text.hpp"
#include "common/ply_header.hpp"

namespace ellicast::common {
namespace {

// The numbers of a binary body.
class BinaryBody {
  public:
    BinaryBody(std::string_view bytes, bool big_endian) : bytes_(bytes), big_(big_endian) {}

    [[nodiscard]] std::size_t left() const { return bytes_.size(); }
    static std::size_t least_size(PlyScalar type) { return size_of(type); }

    std::int64_t integer(PlyScalar type) {
        const std::uint64_t raw = take(size_of(type));
        switch (type) {
            case PlyScalar::i8:
                return static_cast<std::int8_t>(raw);
            case PlyScalar::i16:
                return static_cast<std::int16_t>(raw);
            case PlyScalar::i32:
                return static_cast<std::int32_t>(raw);
            default:
                return static_cast<std::int64_t>(raw);
        }
    }

    double coordinate(PlyScalar type) {
        if (!is_real(type)) return static_cast<double>(integer(type));
        const std::uint64_t raw = take(size_of(type));
        const double value = type == PlyScalar::f32
                                 ? std::bit_cast<float>(static_cast<std::uint32_t>(raw))
                                 : std::bit_cast<double>(raw);
        if (!std::isfinite(value)) throw BadModelFile("a coordinate is not finite");
        if (std::abs(value) > std::numeric_limits<float>::max()) {
            throw BadModelFile("a coordinate is beyond the range of float32");
        }
        return value;
    }

    /// 0 to 255, or a share of one.
    std::uint8_t channel(PlyScalar type) {
        const std::uint64_t raw = take(size_of(type));
        if (!is_real(type)) return static_cast<std::uint8_t>(raw);
        return channel_of_share(type == PlyScalar::f32
                                    ? std::bit_cast<float>(static_cast<std::uint32_t>(raw))
                                    : std::bit_cast<double>(raw));
    }

    void skip(PlyScalar type, std::uint64_t times) {
        if (times > bytes_.size() / size_of(type)) throw BadModelFile("truncated");
        bytes_.remove_prefix(static_cast<std::size_t>(times) * size_of(type));
    }

  private:
    std::uint64_t take(std::size_t size) {
        if (bytes_.size() < size) throw BadModelFile("truncated");
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const auto byte = static_cast<unsigned char>(bytes_[i]);
            value |= std::uint64_t{byte} << (8 * (big_ ? size - 1 - i : i));
        }
        bytes_.remove_prefix(size);
        return value;
    }

    std::string_view bytes_;
    bool big_;
};

// The numbers of an ascii body.
class TextBody {
  public:
    TextBody(std::string_view text, std::size_t first_line)
        : words_(text, '\0', false, first_line) {}

    [[nodiscard]] std::size_t left() const { return words_.bytes_left(); }
    static std::size_t least_size(PlyScalar) { return 1; }

    std::int64_t integer(PlyScalar) {
        const std::string_view word = next();
        return parse_integer(word, words_.line());
    }

    double coordinate(PlyScalar type) {
        const std::string_view word = next();
        if (type == PlyScalar::f32) return parse_coordinate_float(word, words_.line());
        return parse_coordinate(word, words_.line());
    }

    std::uint8_t channel(PlyScalar type) {
        const double value = number<double>(next()).value_or(0.0);
        return is_real(type) ? channel_of_share(value) : channel_of_number(value);
    }

    void skip(PlyScalar, std::uint64_t times) {
        for (std::uint64_t i = 0; i < times; ++i) next();
    }

  private:
    std::string_view next() {
        const std::string_view word = words_.any_token();
        if (word.empty()) throw BadModelFile("truncated");
        return word;
    }

    TextScanner words_;
};

// What the walk collects.
struct Soup {
    std::vector<Eigen::Vector3d> positions;  // unless the file is plain and all float32
    std::vector<Colour> colours;             // where the file has them
    std::string faces;                       // in the form of write_plain, unless the file is plain
};

void append_u32(std::string& out, std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
}

template <class Body>
std::uint64_t list_length(Body& body, const PlyProperty& property) {
    const std::int64_t length = body.integer(*property.count);
    if (length < 0) throw BadModelFile("a list of negative length");
    return static_cast<std::uint64_t>(length);
}

template <class Body>
void skip_property(Body& body, const PlyProperty& property) {
    body.skip(property.type, property.count ? list_length(body, property) : 1);
}

template <class Body>
void walk_vertex(Body& body, const PlyLayout& layout, Soup& soup) {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Colour colour{};
    for (std::size_t c = 0; c < layout.vertex->properties.size(); ++c) {
        const auto axis = std::find(layout.coordinate.begin(), layout.coordinate.end(), c);
        const auto channel = std::find(layout.colour.begin(), layout.colour.end(), c);
        const PlyProperty& property = layout.vertex->properties[c];
        if (axis != layout.coordinate.end()) {
            position[axis - layout.coordinate.begin()] = body.coordinate(property.type);
        } else if (channel != layout.colour.end()) {
            colour[static_cast<std::size_t>(channel - layout.colour.begin())] =
                body.channel(property.type);
        } else {
            skip_property(body, property);
        }
    }
    if (layout.colour[0] != kNoColumn) soup.colours.push_back(colour);
    if (!layout.plain || !layout.float32) soup.positions.push_back(position);
}

template <class Body>
void walk_face(Body& body, const PlyLayout& layout, std::uint64_t entry, Soup& soup) {
    for (std::size_t c = 0; c < layout.face->properties.size(); ++c) {
        const PlyProperty& property = layout.face->properties[c];
        if (c != layout.indices) {
            skip_property(body, property);
            continue;
        }
        const std::uint64_t corners = list_length(body, property);
        if (corners > kMaxFaceCorners) {
            throw BadModelFile("face " + std::to_string(entry) + " has " + std::to_string(corners) +
                               " corners (at most " + std::to_string(kMaxFaceCorners) + ")");
        }
        if (!layout.plain) append_u32(soup.faces, static_cast<std::uint32_t>(corners));
        for (std::uint64_t corner = 0; corner < corners; ++corner) {
            const std::int64_t index = body.integer(property.type);
            if (index < 0 || static_cast<std::uint64_t>(index) >= layout.vertex->entries) {
                throw BadModelFile("face " + std::to_string(entry) + ": index " +
                                   std::to_string(index) + " is out of range");
            }
            if (!layout.plain) append_u32(soup.faces, static_cast<std::uint32_t>(index));
        }
    }
}

template <class Body>
void walk_element(Body& body, const PlyElement& element, const PlyLayout& layout, Soup& soup) {
    std::uint64_t entry_size = 0;
    for (const PlyProperty& property : element.properties) {
        entry_size += Body::least_size(property.count.value_or(property.type));
    }
    if (entry_size == 0) return;
    if (element.entries > body.left() / entry_size) {
        throw BadModelFile("truncated: its header promises " + std::to_string(element.entries) +
                           " entries of " + quoted(element.name));
    }
    if (&element == layout.vertex && !(layout.plain && layout.float32)) {
        soup.positions.reserve(static_cast<std::size_t>(element.entries));
    }
    for (std::uint64_t entry = 0; entry < element.entries; ++entry) {
        if (&element == layout.vertex) {
            walk_vertex(body, layout, soup);
        } else if (&element == layout.face) {
            walk_face(body, layout, entry, soup);
        } else {
            for (const PlyProperty& property : element.properties) skip_property(body, property);
        }
    }
}

template <class Body>
Soup walk(Body body, const PlyHeader& header, const PlyLayout& layout) {
    Soup soup;
    for (const PlyElement& element : header.elements) walk_element(body, element, layout, soup);
    return soup;
}

// The same vertices and faces in the form that OpenMesh reads best.
std::string write_plain(const PlyLayout& layout, const Soup& soup) {
    std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(layout.vertex->entries) +
                      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                      std::to_string(layout.face->entries) +
                      "\nproperty list int int vertex_indices\nend_header\n";
    out.reserve(out.size() + 12 * soup.positions.size() + soup.faces.size());
    for (const Eigen::Vector3d& p : soup.positions) {
        for (const double x : p)
            append_u32(out, std::bit_cast<std::uint32_t>(static_cast<float>(x)));
    }
    out += soup.faces;
    return out;
}

}  // namespace

PlainModelFile check_ply_file(std::string bytes) {
    const PlyHeader header = parse_ply_header(bytes);
    const PlyLayout layout = find_ply_layout(header);
    const std::string_view body = std::string_view(bytes).substr(header.body);
    Soup soup =
        header.encoding == PlyEncoding::ascii
            ? walk(TextBody(body, header.lines + 1), header, layout)
            : walk(BinaryBody(body, header.encoding == PlyEncoding::big_endian), header, layout);
    PlainModelFile file;
    file.vertices = static_cast<std::size_t>(layout.vertex->entries);
    file.faces = static_cast<std::size_t>(layout.face->entries);
    file.bytes = layout.plain ? std::move(bytes) : write_plain(layout, soup);
    if (!layout.float32) file.exact = std::move(soup.positions);
    file.colours = std::move(soup.colours);
    return file;
}

}  // namespace ellicast::common
