// protocol/section_filter.cpp
#include "protocol/section_filter.hpp"

#include "protocol/byte_reader.hpp"
#include "protocol/byte_writer.hpp"
#include "protocol/crc32c.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {
namespace {

using Bytes = std::span<const std::uint8_t>;

bool is_known(std::uint8_t kind) {
    return kind >= static_cast<std::uint8_t>(SectionKind::ellipsoids) &&
           kind <= static_cast<std::uint8_t>(SectionKind::edges);
}

}  // namespace

std::optional<std::vector<std::uint8_t>> keep_sections(
    std::span<const std::uint8_t> datagram, const std::function<bool(const SectionView&)>& keep) {
    const auto view = parse_datagram(datagram);
    if (!view) return std::vector<std::uint8_t>(datagram.begin(), datagram.end());

    const Bytes header = datagram.first(kHeaderBytes);
    std::vector<std::uint8_t> out(header.begin(), header.end());
    out.reserve(datagram.size());
    ByteWriter writer(out);
    Bytes rest = datagram.subspan(kHeaderBytes, datagram.size() - kHeaderBytes - kTrailerBytes);
    auto known = view->sections().begin();
    while (!rest.empty()) {
        // The parser has checked that every section lies within.
        const Bytes section = rest.first(kKindAndLengthBytes + load_u16(rest.data() + 1));
        rest = rest.subspan(section.size());
        if (!is_known(section[0]) || keep(*known++)) writer.bytes(section);
    }
    if (out.size() == kHeaderBytes) return std::nullopt;
    writer.u32(crc32c(out));
    return out;
}

}  // namespace ellicast::protocol
