#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "protocol/datagram.hpp"
#include "receiver/arrival.hpp"
#include "receiver/record_store.hpp"

namespace ellicast::receiver {

/// The table of contents of one sender's carousel, as far as it was heard.
struct Contents {
    SenderKey sender;
    Time last_seen{};
    std::uint16_t pages = 0;                             // in all
    std::map<std::uint16_t, protocol::PageEntry> lines;  // by page
    std::vector<protocol::ObjectId> replaced;  // objects of earlier lines, the latest last

    [[nodiscard]] bool complete() const { return pages > 0 && lines.size() == pages; }
    [[nodiscard]] bool was_replaced(const protocol::ObjectId& object) const;
    /// The line of the object; null when it is not on air, or not told yet.
    [[nodiscard]] const protocol::PageEntry* line_of(const protocol::ObjectId& object) const;
};

/// Collects tables of contents by sender (WIRE_FORMAT.md section 5.4). Of several lines for one
/// page the one with the highest version stays, ties by the smaller object id, then name: a
/// function of the set of lines. Bounded: so many senders, of which lesser ones go for new ones
/// (entry_to_evict), and so many pages each; lines of further pages are not kept. Pure.
class Catalogue {
  public:
    Catalogue(std::size_t senders, std::size_t pages) : senders_(senders), pages_(pages) {}

    /// Takes the lines of an accepted datagram in.
    void on_datagram(Time now, const SenderKey& sender, const protocol::DatagramView& datagram);

    /// Null when none was heard. Invalid after the next on_datagram.
    [[nodiscard]] const Contents* of(const SenderKey& sender) const;
    [[nodiscard]] const std::vector<Contents>& all() const { return contents_; }
    /// Goes up whenever a line is new or another.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }

  private:
    Contents& contents_of(Time now, const SenderKey& sender);

    std::size_t senders_;
    std::size_t pages_;
    std::uint64_t changes_ = 0;
    std::vector<Contents> contents_;
};

}  // namespace ellicast::receiver
