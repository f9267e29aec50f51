#include "protocol/page.hpp"

#include <algorithm>
#include <cassert>

#include "protocol/byte_reader.hpp"
#include "protocol/byte_writer.hpp"
#include "protocol/description.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {
namespace {

constexpr std::size_t kPageBytes = 31;  // before the name's

/// What stands in front of the name's bytes; refers to the body.
struct Fields {
    PageEntry entry;  // without its name
    std::string_view name;
    bool whole = false;
};

Fields read_fields(std::span<const std::uint8_t> body) {
    ByteReader reader(body);
    Fields fields;
    PageEntry& entry = fields.entry;
    entry.page = reader.u16();
    entry.pages = reader.u16();
    entry.version = reader.u32();
    const auto id = reader.bytes(entry.object.size());
    std::ranges::copy(id, entry.object.begin());
    entry.components = reader.u32();
    entry.euler_all = reader.i32();
    entry.ellipsoids = reader.u16();
    entry.vertices = reader.u32();
    const auto name = reader.bytes(reader.u8());
    fields.name = {reinterpret_cast<const char*>(name.data()), name.size()};
    fields.whole = !reader.failed() && reader.left() == 0;
    return fields;
}

}  // namespace

bool is_page(std::span<const std::uint8_t> body) {
    const Fields fields = read_fields(body);
    const PageEntry& entry = fields.entry;
    return fields.whole && entry.page < entry.pages && entry.version >= 1 &&
           entry.components >= 1 && entry.components <= kMaxComponents &&
           entry.euler_all % 2 == 0 && fields.name.size() <= kMaxPageNameBytes &&
           is_presentable(fields.name);
}

PageEntry decode_page(std::span<const std::uint8_t> body) {
    assert(is_page(body));
    Fields fields = read_fields(body);
    fields.entry.name = fields.name;
    return std::move(fields.entry);
}

std::vector<std::uint8_t> encode_page(const PageEntry& entry) {
    assert(entry.page < entry.pages && entry.version >= 1 && entry.components >= 1);
    std::vector<std::uint8_t> body;
    body.reserve(kPageBytes + kMaxPageNameBytes);
    ByteWriter writer(body);
    writer.u16(entry.page);
    writer.u16(entry.pages);
    writer.u32(entry.version);
    writer.bytes(entry.object);
    writer.u32(entry.components);
    writer.i32(entry.euler_all);
    writer.u16(entry.ellipsoids);
    writer.u32(entry.vertices);
    const std::string name = presentable(entry.name, kMaxPageNameBytes);
    writer.u8(static_cast<std::uint8_t>(name.size()));
    writer.bytes({reinterpret_cast<const std::uint8_t*>(name.data()), name.size()});
    return body;
}

}  // namespace ellicast::protocol
