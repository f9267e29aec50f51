// common/model_file_ply.cpp
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/model_file_check.hpp"
#include "common/model_file_text.hpp"

namespace ellicast::common {
namespace {

// Far more than any program writes; they bound the work per entry.
constexpr std::size_t kMaxHeaderLines = 4096;
constexpr std::size_t kMaxHeaderBytes = 1 << 20;

enum class Encoding { ascii, little_endian, big_endian };
enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
    std::string name;
    Scalar type = Scalar::f32;
    std::optional<Scalar> count;  // of a list
};

struct Element {
    std::string name;
    std::uint64_t entries = 0;
    std::vector<Property> properties;
};

struct Header {
    Encoding encoding = Encoding::ascii;
    std::vector<Element> elements;
    std::size_t body = 0;     // offset of the first byte behind it
    std::size_t lines = 0;    // in it
    bool only_layout = true;  // no comments, no carriage returns
};

constexpr std::size_t kNotThere = std::numeric_limits<std::size_t>::max();

struct Layout {
    const Element* vertex = nullptr;
    const Element* face = nullptr;
    std::array<std::size_t, 3> coordinate{kNotThere, kNotThere, kNotThere};  // columns of x, y, z
    std::size_t indices = kNotThere;                                         // column of the face
    bool float32 = true;                                                     // all coordinates
    bool plain = false;  // OpenMesh can read it as it is
};

bool is_real(Scalar type) {
    return type == Scalar::f32 || type == Scalar::f64;
}

std::size_t size_of(Scalar type) {
    switch (type) {
        case Scalar::i8:
        case Scalar::u8:
            return 1;
        case Scalar::i16:
        case Scalar::u16:
            return 2;
        case Scalar::i32:
        case Scalar::u32:
        case Scalar::f32:
            return 4;
        case Scalar::f64:
            break;
    }
    return 8;
}

Scalar parse_type(std::string_view word, std::size_t line) {
    static constexpr std::array<std::pair<std::string_view, Scalar>, 16> kTypes{{
        {"char", Scalar::i8},
        {"int8", Scalar::i8},
        {"uchar", Scalar::u8},
        {"uint8", Scalar::u8},
        {"short", Scalar::i16},
        {"int16", Scalar::i16},
        {"ushort", Scalar::u16},
        {"uint16", Scalar::u16},
        {"int", Scalar::i32},
        {"int32", Scalar::i32},
        {"uint", Scalar::u32},
        {"uint32", Scalar::u32},
        {"float", Scalar::f32},
        {"float32", Scalar::f32},
        {"double", Scalar::f64},
        {"float64", Scalar::f64},
    }};
    for (const auto& [name, type] : kTypes) {
        if (name == word) return type;
    }
    fail_at(line, quoted(word) + " is not a PLY type");
}

Encoding parse_encoding(std::string_view word, std::size_t line) {
    if (word == "ascii") return Encoding::ascii;
    if (word == "binary_little_endian") return Encoding::little_endian;
    if (word == "binary_big_endian") return Encoding::big_endian;
    fail_at(line, quoted(word) + " is not a PLY encoding");
}

Element parse_element(TextScanner& words, std::size_t line) {
    Element element;
    element.name = words.token();
    const std::int64_t entries = parse_integer(words.token(), line);
    // OpenMesh's handles are 32-bit and signed.
    if (entries < 0 || entries > std::numeric_limits<std::int32_t>::max()) {
        fail_at(line, "impossible count " + std::to_string(entries));
    }
    element.entries = static_cast<std::uint64_t>(entries);
    return element;
}

Property parse_property(TextScanner& words, std::size_t line) {
    Property property;
    std::string_view word = words.token();
    if (word == "list") {
        property.count = parse_type(words.token(), line);
        if (is_real(*property.count)) fail_at(line, "a list's length is no integer");
        word = words.token();
    }
    property.type = parse_type(word, line);
    property.name = words.token();
    if (property.name.empty()) fail_at(line, "a property without a name");
    return property;
}

// One line behind the first. True when it ends the header.
bool parse_header_line(std::string_view text, std::size_t line, Header& header,
                       bool& encoding_known) {
    TextScanner words(text);
    const std::string_view keyword = words.token();
    if (keyword == "end_header") {
        if (!encoding_known) fail_at(line, "a header without a format");
        if (text != keyword) header.only_layout = false;
        return true;
    }
    if (keyword == "format") {
        header.encoding = parse_encoding(words.token(), line);
        if (words.token() != "1.0") fail_at(line, "not version 1.0 of the format");
        encoding_known = true;
    } else if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) {
        header.only_layout = false;
        return false;
    } else if (keyword == "element") {
        header.elements.push_back(parse_element(words, line));
    } else if (keyword == "property") {
        if (header.elements.empty()) fail_at(line, "a property before any element");
        header.elements.back().properties.push_back(parse_property(words, line));
    } else {
        fail_at(line, quoted(keyword) + " has no place in a PLY header");
    }
    const std::string_view surplus = words.token();
    if (!surplus.empty()) fail_at(line, quoted(surplus) + " is one word too many");
    return false;
}

Header parse_header(std::string_view bytes) {
    Header header;
    bool encoding_known = false;
    while (header.lines < kMaxHeaderLines) {
        const std::string_view rest = bytes.substr(header.body, kMaxHeaderBytes);
        const std::size_t length = rest.find('\n');
        if (length == rest.npos) break;
        std::string_view text = rest.substr(0, length);
        header.body += length + 1;
        ++header.lines;
        if (!text.empty() && text.back() == '\r') {
            text.remove_suffix(1);
            header.only_layout = false;
        }
        if (header.lines == 1) {
            if (text != "ply" && text != "PLY") throw BadModelFile("not a PLY file");
        } else if (parse_header_line(text, header.lines, header, encoding_known)) {
            return header;
        }
    }
    throw BadModelFile(header.lines == 0 ? "not a PLY file" : "truncated: its header has no end");
}

bool is_index_list(const Property& property) {
    return property.name == "vertex_indices" || property.name == "vertex_index";
}

// What OpenMesh 9 reads right without help.
bool is_plain(const Header& header, const Layout& layout) {
    if (!header.only_layout || header.elements.size() != 2) return false;
    if (layout.vertex != &header.elements[0] || layout.vertex->properties.size() != 3) return false;
    for (const Property& property : layout.vertex->properties) {
        if (property.count || !is_real(property.type)) return false;
    }
    if (layout.face->properties.size() != 1) return false;
    const Scalar count = *layout.face->properties[0].count;
    return count == Scalar::u8;
}

Layout find_layout(const Header& header) {
    Layout layout;
    for (const Element& element : header.elements) {
        const Element** place = element.name == "vertex" ? &layout.vertex
                                : element.name == "face" ? &layout.face
                                                         : nullptr;
        if (place == nullptr) continue;
        if (*place != nullptr) throw BadModelFile("two elements named " + element.name);
        *place = &element;
    }
    if (layout.vertex == nullptr || layout.vertex->entries == 0) throw BadModelFile("no vertices");
    if (layout.face == nullptr || layout.face->entries == 0) throw BadModelFile("no faces");

    const std::vector<Property>& columns = layout.vertex->properties;
    for (std::size_t c = 0; c < columns.size(); ++c) {
        static constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (columns[c].name != kAxes[axis]) continue;
            if (columns[c].count || layout.coordinate[axis] != kNotThere) {
                throw BadModelFile("no single column " + columns[c].name);
            }
            layout.coordinate[axis] = c;
            layout.float32 = layout.float32 && columns[c].type == Scalar::f32;
        }
    }
    for (const std::size_t column : layout.coordinate) {
        if (column == kNotThere) throw BadModelFile("vertices without x, y and z");
    }
    for (std::size_t c = 0; c < layout.face->properties.size(); ++c) {
        const Property& property = layout.face->properties[c];
        if (!is_index_list(property)) continue;
        if (!property.count || is_real(property.type) || layout.indices != kNotThere) {
            throw BadModelFile("faces without one list of vertex indices");
        }
        layout.indices = c;
    }
    if (layout.indices == kNotThere) throw BadModelFile("faces without one list of vertex indices");
    layout.plain = is_plain(header, layout);
    return layout;
}

// The numbers of a binary body.
class BinaryBody {
  public:
    BinaryBody(std::string_view bytes, bool big_endian) : bytes_(bytes), big_(big_endian) {}

    [[nodiscard]] std::size_t left() const { return bytes_.size(); }
    static std::size_t least_size(Scalar type) { return size_of(type); }

    std::int64_t integer(Scalar type) {
        const std::uint64_t raw = take(size_of(type));
        switch (type) {
            case Scalar::i8:
                return static_cast<std::int8_t>(raw);
            case Scalar::i16:
                return static_cast<std::int16_t>(raw);
            case Scalar::i32:
                return static_cast<std::int32_t>(raw);
            default:
                return static_cast<std::int64_t>(raw);
        }
    }

    double coordinate(Scalar type) {
        if (!is_real(type)) return static_cast<double>(integer(type));
        const std::uint64_t raw = take(size_of(type));
        const double value = type == Scalar::f32
                                 ? std::bit_cast<float>(static_cast<std::uint32_t>(raw))
                                 : std::bit_cast<double>(raw);
        if (!std::isfinite(value)) throw BadModelFile("a coordinate is not finite");
        if (std::abs(value) > std::numeric_limits<float>::max()) {
            throw BadModelFile("a coordinate is beyond the range of float32");
        }
        return value;
    }

    void skip(Scalar type, std::uint64_t times) {
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
    static std::size_t least_size(Scalar) { return 1; }

    std::int64_t integer(Scalar) {
        const std::string_view word = next();
        return parse_integer(word, words_.line());
    }

    double coordinate(Scalar type) {
        const std::string_view word = next();
        if (type == Scalar::f32) return parse_coordinate_float(word, words_.line());
        return parse_coordinate(word, words_.line());
    }

    void skip(Scalar, std::uint64_t times) {
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
    std::string faces;                       // in the form of write_plain, unless the file is plain
};

void append_u32(std::string& out, std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
}

template <class Body>
std::uint64_t list_length(Body& body, const Property& property) {
    const std::int64_t length = body.integer(*property.count);
    if (length < 0) throw BadModelFile("a list of negative length");
    return static_cast<std::uint64_t>(length);
}

template <class Body>
void skip_property(Body& body, const Property& property) {
    body.skip(property.type, property.count ? list_length(body, property) : 1);
}

template <class Body>
void walk_vertex(Body& body, const Layout& layout, Soup& soup) {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < layout.vertex->properties.size(); ++c) {
        const auto axis = std::find(layout.coordinate.begin(), layout.coordinate.end(), c);
        const Property& property = layout.vertex->properties[c];
        if (axis == layout.coordinate.end()) {
            skip_property(body, property);
        } else {
            position[axis - layout.coordinate.begin()] = body.coordinate(property.type);
        }
    }
    if (!layout.plain || !layout.float32) soup.positions.push_back(position);
}

template <class Body>
void walk_face(Body& body, const Layout& layout, std::uint64_t entry, Soup& soup) {
    for (std::size_t c = 0; c < layout.face->properties.size(); ++c) {
        const Property& property = layout.face->properties[c];
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
void walk_element(Body& body, const Element& element, const Layout& layout, Soup& soup) {
    std::uint64_t entry_size = 0;
    for (const Property& property : element.properties) {
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
            for (const Property& property : element.properties) skip_property(body, property);
        }
    }
}

template <class Body>
Soup walk(Body body, const Header& header, const Layout& layout) {
    Soup soup;
    for (const Element& element : header.elements) walk_element(body, element, layout, soup);
    return soup;
}

// The same vertices and faces in the form that OpenMesh reads best.
std::string write_plain(const Layout& layout, const Soup& soup) {
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
    const Header header = parse_header(bytes);
    const Layout layout = find_layout(header);
    const std::string_view body = std::string_view(bytes).substr(header.body);
    Soup soup =
        header.encoding == Encoding::ascii
            ? walk(TextBody(body, header.lines + 1), header, layout)
            : walk(BinaryBody(body, header.encoding == Encoding::big_endian), header, layout);
    PlainModelFile file;
    file.vertices = static_cast<std::size_t>(layout.vertex->entries);
    file.faces = static_cast<std::size_t>(layout.face->entries);
    file.bytes = layout.plain ? std::move(bytes) : write_plain(layout, soup);
    if (!layout.float32) file.exact = std::move(soup.positions);
    return file;
}

}  // namespace ellicast::common
