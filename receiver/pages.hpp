#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "receiver/catalogue.hpp"
#include "receiver/record_store.hpp"

namespace ellicast::receiver {

/// Which pages the user wants.
struct PageChoice {
    std::vector<std::string> wanted;  // names, or object ids of 16 hex digits; empty: any
    bool all = false;                 // all of those, else only the one that is shown
};

/// A page as the receiver has it: the objects that were sent under one name by one station.
struct Page {
    std::string name;           // as described, as told in the contents, or the object id
    std::uint32_t version = 1;  // as told; 1 when nothing is told
    /// The newest first: the one that the contents tell, else by when they were last heard.
    std::vector<const RecordStore::Group*> versions;

    [[nodiscard]] const RecordStore::Group& current() const { return *versions.front(); }
    /// What to make a mesh of: the newest version that has a shape, that is half of its ellipsoids;
    /// else the newest with any; else the newest.
    [[nodiscard]] const RecordStore::Group& best() const;
};

/// What is known of the end of reception.
struct PageGoal {
    bool complete = false;  // every record of every chosen page is there
    // When the last of them all was over, once it was for all.
    std::optional<Time> stream_end;
    std::optional<Time> full_round_end;
};

/// The description's name, else the contents' for this object, else the object id in hexadecimal.
std::string page_name(const RecordStore::Group& group, const Catalogue& catalogue);

/// Whether `wanted` names a group: by the object id, or by the name, of which the first
/// kMaxPageNameBytes must do where only the contents tell it.
bool matches(const std::string& wanted, const RecordStore::Group& group,
             const Catalogue& catalogue);

/// The chosen pages. First the one with the group of the most distinct records (ties as
/// RecordStore::shown) among those wanted; with PageChoice::all then the same station's others by
/// name. Empty when nothing of a wanted page was received. The pointers last as long as the store
/// is left alone.
std::vector<Page> chosen_pages(const RecordStore& store, const Catalogue& catalogue,
                               const PageChoice& choice);

/// What is known of the end of these pages: chosen_pages() of the same arguments. Nothing is
/// complete or over before all pages are known that the choice means: those wanted by name, or all
/// that the contents list. A stream without contents has one page.
PageGoal goal_of(const std::vector<Page>& pages, const Catalogue& catalogue,
                 const PageChoice& choice);

/// Versions of a page that nobody needs, for the listed one has a shape: those that the contents
/// listed earlier, and those that were silent for kForgotten when the listed one was heard. (One
/// that was never listed may be the next, whose line was lost.)
inline constexpr Time kForgotten = std::chrono::seconds(30);
std::vector<const RecordStore::Group*> outdated(const std::vector<Page>& pages,
                                                const Catalogue& catalogue);

}  // namespace ellicast::receiver
