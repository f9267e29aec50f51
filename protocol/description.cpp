// protocol/description.cpp
#include "protocol/description.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "protocol/byte_reader.hpp"
#include "protocol/byte_writer.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {
namespace {

struct Character {
    std::size_t length = 0;  // bytes; 0 = not UTF-8
    std::uint32_t code = 0;
};

std::uint8_t byte_at(std::string_view text, std::size_t k) {
    return static_cast<std::uint8_t>(text[k]);
}

/// The character at the start of a text that is not empty.
Character first_character(std::string_view text) {
    const std::uint8_t lead = byte_at(text, 0);
    if (lead < 0x80) return {1, lead};
    std::size_t length = 0;
    std::uint32_t least = 0;  // codes below have a shorter form
    if ((lead & 0xe0) == 0xc0) length = 2, least = 0x80;
    if ((lead & 0xf0) == 0xe0) length = 3, least = 0x800;
    if ((lead & 0xf8) == 0xf0) length = 4, least = 0x10000;
    if (length == 0 || text.size() < length) return {};
    std::uint32_t code = lead & (0x7fu >> length);
    for (std::size_t k = 1; k < length; ++k) {
        const std::uint8_t next = byte_at(text, k);
        if ((next & 0xc0) != 0x80) return {};
        code = code << 6 | (next & 0x3fu);
    }
    const bool surrogate = code >= 0xd800 && code <= 0xdfff;
    if (code < least || code > 0x10ffff || surrogate) return {};
    return {length, code};
}

bool is_control(std::uint32_t code) {
    return code < 0x20 || (code >= 0x7f && code < 0xa0);
}

std::string_view text_of(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string_view read_string(ByteReader& reader) {
    const std::size_t length = reader.u8();
    return text_of(reader.bytes(length));
}

bool is_origin(double value) {
    return std::abs(value) <= double{kMaxCoordinate};
}

constexpr std::size_t kStrings = 4;  // name, unit, certificate, sender version

}  // namespace

bool is_presentable(std::string_view text) {
    while (!text.empty()) {
        const Character c = first_character(text);
        if (c.length == 0 || is_control(c.code)) return false;
        text.remove_prefix(c.length);
    }
    return true;
}

std::string presentable(std::string_view text, std::size_t most) {
    std::string out;
    while (!text.empty()) {
        const Character c = first_character(text);
        const bool keep = c.length > 0 && !is_control(c.code);
        const std::string_view shown = keep ? text.substr(0, c.length) : std::string_view("_");
        if (out.size() + shown.size() > most) break;
        out += shown;
        text.remove_prefix(std::max<std::size_t>(1, c.length));
    }
    return out;
}

bool is_description(std::span<const std::uint8_t> body) {
    ByteReader reader(body);
    bool ok = true;
    for (int axis = 0; axis < 3; ++axis) ok &= is_origin(reader.f64());
    for (std::size_t k = 0; k < kStrings; ++k) ok &= is_presentable(read_string(reader));
    return ok && !reader.failed() && reader.left() == 0;
}

Description decode_description(std::span<const std::uint8_t> body) {
    assert(is_description(body));
    ByteReader reader(body);
    Description description;
    for (double& value : description.origin) value = reader.f64();
    for (std::string* text : {&description.name, &description.unit, &description.certificate,
                              &description.sender_version}) {
        *text = read_string(reader);
    }
    return description;
}

std::vector<std::uint8_t> encode_description(const Description& description) {
    std::vector<std::uint8_t> body;
    ByteWriter writer(body);
    for (const double value : description.origin) {
        assert(is_origin(value));
        writer.f64(value);
    }
    for (const std::string* text : {&description.name, &description.unit, &description.certificate,
                                    &description.sender_version}) {
        const std::string shown = presentable(*text);
        writer.u8(static_cast<std::uint8_t>(shown.size()));
        writer.bytes({reinterpret_cast<const std::uint8_t*>(shown.data()), shown.size()});
    }
    return body;
}

}  // namespace ellicast::protocol
