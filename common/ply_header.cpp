// common/ply_header.cpp
#include "common/ply_header.hpp"

#include <algorithm>
#include <utility>

#include "common/model_file_check.hpp"
#include "common/model_file_text.hpp"

namespace ellicast::common {
namespace {

// Far more than any program writes; they bound the work per entry.
constexpr std::size_t kMaxHeaderLines = 4096;
constexpr std::size_t kMaxHeaderBytes = 1 << 20;

PlyScalar parse_type(std::string_view word, std::size_t line) {
    static constexpr std::array<std::pair<std::string_view, PlyScalar>, 16> kTypes{{
        {"char", PlyScalar::i8},
        {"int8", PlyScalar::i8},
        {"uchar", PlyScalar::u8},
        {"uint8", PlyScalar::u8},
        {"short", PlyScalar::i16},
        {"int16", PlyScalar::i16},
        {"ushort", PlyScalar::u16},
        {"uint16", PlyScalar::u16},
        {"int", PlyScalar::i32},
        {"int32", PlyScalar::i32},
        {"uint", PlyScalar::u32},
        {"uint32", PlyScalar::u32},
        {"float", PlyScalar::f32},
        {"float32", PlyScalar::f32},
        {"double", PlyScalar::f64},
        {"float64", PlyScalar::f64},
    }};
    for (const auto& [name, type] : kTypes) {
        if (name == word) return type;
    }
    fail_at(line, quoted(word) + " is not a PLY type");
}

PlyEncoding parse_encoding(std::string_view word, std::size_t line) {
    if (word == "ascii") return PlyEncoding::ascii;
    if (word == "binary_little_endian") return PlyEncoding::little_endian;
    if (word == "binary_big_endian") return PlyEncoding::big_endian;
    fail_at(line, quoted(word) + " is not a PLY encoding");
}

PlyElement parse_element(TextScanner& words, std::size_t line) {
    PlyElement element;
    element.name = words.token();
    const std::int64_t entries = parse_integer(words.token(), line);
    // OpenMesh's handles are 32-bit and signed.
    if (entries < 0 || entries > std::numeric_limits<std::int32_t>::max()) {
        fail_at(line, "impossible count " + std::to_string(entries));
    }
    element.entries = static_cast<std::uint64_t>(entries);
    return element;
}

PlyProperty parse_property(TextScanner& words, std::size_t line) {
    PlyProperty property;
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
bool parse_header_line(std::string_view text, std::size_t line, PlyHeader& header,
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

bool is_index_list(const PlyProperty& property) {
    return property.name == "vertex_indices" || property.name == "vertex_index";
}

// All three or none; what is no colour after all is no fault either.
std::array<std::size_t, 3> find_colour(const std::vector<PlyProperty>& columns) {
    static constexpr std::array<std::string_view, 3> kChannels{"red", "green", "blue"};
    constexpr std::string_view kPrefix = "diffuse_";
    std::array<std::size_t, 3> found{kNoColumn, kNoColumn, kNoColumn};
    for (std::size_t c = 0; c < columns.size(); ++c) {
        std::string_view name = columns[c].name;
        if (name.starts_with(kPrefix)) name.remove_prefix(kPrefix.size());
        const auto channel = std::find(kChannels.begin(), kChannels.end(), name);
        if (channel == kChannels.end() || columns[c].count) continue;
        std::size_t& place = found[static_cast<std::size_t>(channel - kChannels.begin())];
        if (place == kNoColumn) place = c;
    }
    constexpr std::array<std::size_t, 3> kNone{kNoColumn, kNoColumn, kNoColumn};
    if (std::find(found.begin(), found.end(), kNoColumn) != found.end()) return kNone;
    const PlyScalar type = columns[found[0]].type;
    const bool alike = columns[found[1]].type == type && columns[found[2]].type == type;
    return alike && (type == PlyScalar::u8 || is_real(type)) ? found : kNone;
}

// What OpenMesh 9 reads right without help.
bool is_plain(const PlyHeader& header, const PlyLayout& layout) {
    if (!header.only_layout || header.elements.size() != 2) return false;
    if (layout.vertex != &header.elements[0] || layout.vertex->properties.size() != 3) return false;
    for (const PlyProperty& property : layout.vertex->properties) {
        if (property.count || !is_real(property.type)) return false;
    }
    if (layout.face->properties.size() != 1) return false;
    const PlyScalar count = *layout.face->properties[0].count;
    return count == PlyScalar::u8;
}

}  // namespace

bool is_real(PlyScalar type) {
    return type == PlyScalar::f32 || type == PlyScalar::f64;
}

std::size_t size_of(PlyScalar type) {
    switch (type) {
        case PlyScalar::i8:
        case PlyScalar::u8:
            return 1;
        case PlyScalar::i16:
        case PlyScalar::u16:
            return 2;
        case PlyScalar::i32:
        case PlyScalar::u32:
        case PlyScalar::f32:
            return 4;
        case PlyScalar::f64:
            break;
    }
    return 8;
}

PlyHeader parse_ply_header(std::string_view bytes) {
    PlyHeader header;
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

PlyLayout find_ply_layout(const PlyHeader& header) {
    PlyLayout layout;
    for (const PlyElement& element : header.elements) {
        const PlyElement** place = element.name == "vertex" ? &layout.vertex
                                   : element.name == "face" ? &layout.face
                                                            : nullptr;
        if (place == nullptr) continue;
        if (*place != nullptr) throw BadModelFile("two elements named " + element.name);
        *place = &element;
    }
    if (layout.vertex == nullptr || layout.vertex->entries == 0) throw BadModelFile("no vertices");
    if (layout.face == nullptr || layout.face->entries == 0) throw BadModelFile("no faces");

    const std::vector<PlyProperty>& columns = layout.vertex->properties;
    for (std::size_t c = 0; c < columns.size(); ++c) {
        static constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (columns[c].name != kAxes[axis]) continue;
            if (columns[c].count || layout.coordinate[axis] != kNoColumn) {
                throw BadModelFile("no single column " + columns[c].name);
            }
            layout.coordinate[axis] = c;
            layout.float32 = layout.float32 && columns[c].type == PlyScalar::f32;
        }
    }
    for (const std::size_t column : layout.coordinate) {
        if (column == kNoColumn) throw BadModelFile("vertices without x, y and z");
    }
    for (std::size_t c = 0; c < layout.face->properties.size(); ++c) {
        const PlyProperty& property = layout.face->properties[c];
        if (!is_index_list(property)) continue;
        if (!property.count || is_real(property.type) || layout.indices != kNoColumn) {
            throw BadModelFile("faces without one list of vertex indices");
        }
        layout.indices = c;
    }
    if (layout.indices == kNoColumn) throw BadModelFile("faces without one list of vertex indices");
    layout.colour = find_colour(columns);
    layout.plain = is_plain(header, layout);
    return layout;
}

}  // namespace ellicast::common
