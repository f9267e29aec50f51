// tests/protocol/promises.cpp
#include "tests/protocol/promises.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/description.hpp"
#include "protocol/section_filter.hpp"

namespace ellicast::tests {
namespace {

using namespace ellicast::protocol;

std::string broken_by_header(const DatagramHeader& header) {
    if (!acceptable(header.hint)) return "hint";
    if (header.ordinal >= header.datagrams) return "ordinal";
    if (header.rounds != 0 && header.round >= header.rounds) return "round";
    return "";
}

std::string broken_by_description(const Description& description) {
    for (const double x : description.origin) {
        if (!std::isfinite(x)) return "origin";
    }
    for (const std::string* text : {&description.name, &description.unit, &description.certificate,
                                    &description.sender_version}) {
        if (text->size() > 255 || !is_presentable(*text)) return "string";
    }
    return "";
}

/// What the format does not have reads as zero, and no tag is wider than it says.
bool has_tags_of(const VertexRecord& vertex, const RecordFormat& format) {
    return vertex.normal >> format.normal_bits == 0 && vertex.ring < (format.ring ? 256 : 1) &&
           (format.colour || vertex.colour == VertexRecord{}.colour) && vertex.unused == 0;
}

std::string broken_by_records(const SectionView& section, const Hint& hint) {
    const bool ellipsoids = section.kind == SectionKind::ellipsoids;
    const std::uint32_t total = ellipsoids ? hint.ellipsoids : hint.vertices;
    if (section.count == 0) return "count";
    for (std::size_t k = 0; k < section.count; ++k) {
        if (section.index(k) >= total) return "index";
        if (k > 0 && section.index(k) <= section.index(k - 1)) return "index order";
        const bool good = ellipsoids ? acceptable(section.ellipsoid(k), hint)
                                     : acceptable(section.vertex(k), hint);
        if (!good) return "record";
        if (!ellipsoids && !has_tags_of(section.vertex(k), hint.format)) return "tags";
    }
    return "";
}

std::string broken_by_page(const PageEntry& entry) {
    if (entry.page >= entry.pages) return "page";
    if (entry.version == 0) return "version";
    if (entry.components == 0 || entry.euler_all % 2 != 0) return "topology";
    return entry.name.size() <= kMaxPageNameBytes && is_presentable(entry.name) ? "" : "page name";
}

std::string broken_by_edges(const SectionView& section, const Hint& hint) {
    if (section.count == 0) return "count";
    for (std::size_t k = 0; k < section.count; ++k) {
        const EdgeRecord edge = section.edge(k);
        if (edge.a >= edge.b || edge.b >= edge.among || edge.among > hint.vertices) return "edge";
    }
    return "";
}

std::string broken_by(const SectionView& section, const Hint& hint) {
    switch (section.kind) {
        case SectionKind::description:
            return broken_by_description(section.description());
        case SectionKind::page:
            return broken_by_page(section.page());
        case SectionKind::edges:
            return broken_by_edges(section, hint);
        case SectionKind::ellipsoids:
        case SectionKind::vertices:
            return broken_by_records(section, hint);
    }
    return "kind";
}

void add_again(DatagramWriter& writer, const SectionView& section) {
    if (section.kind == SectionKind::description) {
        (void)writer.add_description(section.description());
    } else if (section.kind == SectionKind::page) {
        (void)writer.add_page(section.page());
    } else if (section.kind == SectionKind::edges) {
        std::vector<EdgeRecord> edges(section.count);
        for (std::size_t k = 0; k < edges.size(); ++k) edges[k] = section.edge(k);
        writer.add_edges(edges);
    } else if (section.kind == SectionKind::ellipsoids) {
        std::vector<EllipsoidRecord> records(section.count);
        for (std::size_t k = 0; k < records.size(); ++k) records[k] = section.ellipsoid(k);
        writer.add_ellipsoids(section.first, section.stride, records);
    } else {
        std::vector<VertexRecord> records(section.count);
        for (std::size_t k = 0; k < records.size(); ++k) records[k] = section.vertex(k);
        writer.add_vertices(section.first, section.stride, records);
    }
}

/// Written again from what was read, the datagram must have the bytes that it had, but for sections
/// of unknown kinds.
std::string broken_by_writing(std::span<const std::uint8_t> datagram, const DatagramView& view) {
    if (view.section_count == 0 || datagram.size() > kMaxDatagramBytes) return "";
    DatagramWriter writer(view.header, kMaxDatagramBytes);
    for (const SectionView& section : view.sections()) add_again(writer, section);
    const auto again = writer.finish();
    if (again.size() == datagram.size() && !std::ranges::equal(again, datagram)) return "writing";
    const auto read = parse_datagram(again);
    if (!read || read->header != view.header) return "reading again";
    return read->section_count == view.section_count ? "" : "sections read again";
}

std::string broken_by_filter(std::span<const std::uint8_t> datagram) {
    const auto all = keep_sections(datagram, [](const SectionView&) { return true; });
    if (!all || !std::ranges::equal(*all, datagram)) return "keeping all sections";
    bool turn = false;
    const auto some = keep_sections(datagram, [&](const SectionView&) { return turn = !turn; });
    if (some && !parse_datagram(*some)) return "keeping some sections";
    return "";
}

std::string broken_by_stamp(std::span<const std::uint8_t> datagram) {
    std::vector<std::uint8_t> copy(datagram.begin(), datagram.end());
    stamp(copy, 1, 2);
    const auto view = parse_datagram(copy);
    const bool good = view && view->header.rtp.sequence == 1 && view->header.rtp.timestamp == 2;
    return good ? "" : "stamp";
}

}  // namespace

std::string broken_promise(std::span<const std::uint8_t> datagram) {
    const auto view = parse_datagram(datagram);
    if (!view) return "acceptance";
    std::string broken = broken_by_header(view->header);
    if (view->section_count > kMaxSections) broken = "number of sections";
    for (const SectionView& section : view->sections()) {
        if (broken.empty()) broken = broken_by(section, view->header.hint);
    }
    if (broken.empty()) broken = broken_by_writing(datagram, *view);
    if (broken.empty()) broken = broken_by_filter(datagram);
    if (broken.empty()) broken = broken_by_stamp(datagram);
    return broken;
}

}  // namespace ellicast::tests
