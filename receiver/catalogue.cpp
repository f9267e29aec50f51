#include "receiver/catalogue.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "receiver/eviction.hpp"

namespace ellicast::receiver {
namespace {

bool supersedes(const protocol::PageEntry& a, const protocol::PageEntry& b) {
    if (a.version != b.version) return a.version > b.version;
    const auto order = [](const protocol::PageEntry& e) {
        return std::tie(e.object, e.name, e.components, e.euler_all, e.ellipsoids, e.vertices);
    };
    return order(a) < order(b);
}

// More than that many versions back nobody has anything of.
constexpr std::size_t kMostReplaced = 256;

void replace(Contents& contents, protocol::PageEntry& old, protocol::PageEntry line) {
    std::vector<protocol::ObjectId>& replaced = contents.replaced;
    if (old.object != line.object) {
        if (replaced.size() == kMostReplaced) replaced.erase(replaced.begin());
        replaced.push_back(old.object);
    }
    std::erase(replaced, line.object);  // a page may become again what it was
    old = std::move(line);
}

}  // namespace

const protocol::PageEntry* Contents::line_of(const protocol::ObjectId& object) const {
    for (const auto& [page, line] : lines) {
        if (line.object == object) return &line;
    }
    return nullptr;
}

bool Contents::was_replaced(const protocol::ObjectId& object) const {
    return std::find(replaced.begin(), replaced.end(), object) != replaced.end();
}

Contents& Catalogue::contents_of(Time now, const SenderKey& sender) {
    const auto known = std::find_if(contents_.begin(), contents_.end(),
                                    [&](const Contents& c) { return c.sender == sender; });
    if (known != contents_.end()) return *known;
    if (contents_.size() >= senders_) {
        const std::size_t victim = entry_to_evict(
            contents_, [](const Contents& c) { return c.lines.size(); },
            [](const Contents& c) { return c.last_seen; });
        contents_.erase(contents_.begin() + static_cast<std::ptrdiff_t>(victim));
    }
    contents_.push_back(
        {.sender = sender, .last_seen = now, .pages = 0, .lines = {}, .replaced = {}});
    return contents_.back();
}

void Catalogue::on_datagram(Time now, const SenderKey& sender,
                            const protocol::DatagramView& datagram) {
    for (const protocol::SectionView& section : datagram.sections()) {
        if (section.kind != protocol::SectionKind::page) continue;
        protocol::PageEntry line = section.page();
        Contents& contents = contents_of(now, sender);
        contents.last_seen = now;
        if (line.pages > contents.pages) {
            contents.pages = line.pages;
            ++changes_;
        }
        const auto known = contents.lines.find(line.page);
        if (known == contents.lines.end()) {
            if (contents.lines.size() >= pages_) continue;
            contents.lines.emplace(line.page, std::move(line));
            ++changes_;
        } else if (supersedes(line, known->second)) {
            replace(contents, known->second, std::move(line));
            ++changes_;
        }
    }
}

const Contents* Catalogue::of(const SenderKey& sender) const {
    const auto known = std::find_if(contents_.begin(), contents_.end(),
                                    [&](const Contents& c) { return c.sender == sender; });
    return known == contents_.end() ? nullptr : &*known;
}

}  // namespace ellicast::receiver
