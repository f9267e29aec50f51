#include "receiver/pages.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "common/hex_text.hpp"

namespace ellicast::receiver {
namespace {

using Group = RecordStore::Group;

const protocol::PageEntry* line_of(const Group& group, const Catalogue& catalogue) {
    const Contents* const contents = catalogue.of(group.sender);
    return contents ? contents->line_of(group.object) : nullptr;
}

bool has_shape(const Group& group) {
    return group.ellipsoids.size() > 0 && 2 * group.ellipsoids.size() >= group.hint.ellipsoids;
}

bool is_wanted(const PageChoice& choice, const Group& group, const Catalogue& catalogue) {
    return choice.wanted.empty() ||
           std::any_of(choice.wanted.begin(), choice.wanted.end(), [&](const std::string& wanted) {
               return matches(wanted, group, catalogue);
           });
}

/// Newest first: what the contents tell, then the last heard. Of groups with one object, of which
/// a restarted sender's may not be united yet, the one with the most records stands for all. The
/// rest of the order is only there so that there is one.
void sort_versions(std::vector<const Group*>& versions, const Catalogue& catalogue) {
    std::map<protocol::ObjectId, std::pair<bool, Time>> news;
    for (const Group* const group : versions) {
        auto& [listed, seen] = news[group->object];
        listed = listed || line_of(*group, catalogue) != nullptr;
        seen = std::max(seen, group->last_seen);
    }
    const auto rank = [&](const Group* group) {
        return std::tuple(news[group->object], group->object, group->records());
    };
    std::stable_sort(versions.begin(), versions.end(),
                     [&](const Group* a, const Group* b) { return rank(a) > rank(b); });
}

Page page_of(std::string name, std::vector<const Group*> versions, const Catalogue& catalogue) {
    sort_versions(versions, catalogue);
    Page page;
    page.name = std::move(name);
    page.versions = std::move(versions);
    if (const auto* const line = line_of(page.current(), catalogue)) page.version = line->version;
    return page;
}

/// Whether `pages` are all that the choice means.
bool all_known(const std::vector<Page>& pages, const Catalogue& catalogue,
               const PageChoice& choice) {
    const auto has = [&](const auto& is_it) {
        return std::any_of(pages.begin(), pages.end(),
                           [&](const Page& page) { return is_it(page.current()); });
    };
    if (!choice.wanted.empty()) {
        return std::all_of(choice.wanted.begin(), choice.wanted.end(), [&](const auto& wanted) {
            return has([&](const Group& group) { return matches(wanted, group, catalogue); });
        });
    }
    const Contents* const contents = catalogue.of(pages.front().current().sender);
    if (!contents) return true;
    return contents->complete() &&
           std::all_of(contents->lines.begin(), contents->lines.end(), [&](const auto& line) {
               return has([&](const Group& group) { return group.object == line.second.object; });
           });
}

/// The latest of the moments when all pages have one.
template <class Moment>
std::optional<Time> last_of(const std::vector<Page>& pages, const Moment& moment) {
    std::optional<Time> last;
    for (const Page& page : pages) {
        const std::optional<Time> its = moment(page.current().progress);
        if (!its) return std::nullopt;
        last = std::max(last.value_or(*its), *its);
    }
    return last;
}

/// The stream's last page is over: all are.
std::optional<Time> end_of_last_page(const std::vector<Page>& pages, const Catalogue& catalogue) {
    const Contents* const contents = catalogue.of(pages.front().current().sender);
    if (!contents || contents->lines.empty()) return std::nullopt;
    const auto& [place, line] = *contents->lines.rbegin();
    if (place + 1 != contents->pages) return std::nullopt;
    for (const Page& page : pages) {
        if (page.current().object == line.object) return page.current().progress.stream_end();
    }
    return std::nullopt;
}

}  // namespace

const Group& Page::best() const {
    const auto with = [&](const auto& enough) {
        const auto found = std::find_if(versions.begin(), versions.end(),
                                        [&](const Group* group) { return enough(*group); });
        return found == versions.end() ? nullptr : *found;
    };
    if (const Group* const shaped = with(has_shape)) return *shaped;
    const Group* const any = with([](const Group& group) { return group.ellipsoids.size() > 0; });
    return any ? *any : current();
}

std::string page_name(const Group& group, const Catalogue& catalogue) {
    if (group.description && !group.description->name.empty()) return group.description->name;
    const protocol::PageEntry* const line = line_of(group, catalogue);
    return line && !line->name.empty() ? line->name : common::hex_text(group.object);
}

bool matches(const std::string& wanted, const Group& group, const Catalogue& catalogue) {
    if (common::bytes_of_hex<sizeof(protocol::ObjectId)>(wanted) == group.object) return true;
    if (group.description) return group.description->name == wanted;
    const protocol::PageEntry* const line = line_of(group, catalogue);
    if (!line || line->name.empty()) return false;
    // The cut falls on a character's border, so it may be up to three bytes early.
    const bool cut = wanted.size() > protocol::kMaxPageNameBytes &&
                     line->name.size() + 3 >= protocol::kMaxPageNameBytes;
    return cut ? wanted.compare(0, line->name.size(), line->name) == 0 : wanted == line->name;
}

std::vector<Page> chosen_pages(const RecordStore& store, const Catalogue& catalogue,
                               const PageChoice& choice) {
    const Group* const first =
        store.greatest([&](const Group& group) { return is_wanted(choice, group, catalogue); });
    if (!first) return {};
    std::map<std::string, std::vector<const Group*>> by_name;
    for (const Group& group : store.groups()) {
        if (!same_station(group.sender, first->sender)) continue;
        if (!is_wanted(choice, group, catalogue)) continue;
        by_name[page_name(group, catalogue)].push_back(&group);
    }
    std::vector<Page> pages;
    const std::string first_name = page_name(*first, catalogue);
    pages.push_back(page_of(first_name, std::move(by_name[first_name]), catalogue));
    for (auto& [name, versions] : by_name) {
        if (!choice.all || name == first_name) continue;
        pages.push_back(page_of(name, std::move(versions), catalogue));
    }
    return pages;
}

PageGoal goal_of(const std::vector<Page>& pages, const Catalogue& catalogue,
                 const PageChoice& choice) {
    PageGoal goal;
    if (pages.empty()) return goal;
    if (!choice.all) {
        const Group& group = pages.front().current();
        return {group.complete(), group.progress.stream_end(), group.progress.full_round_end()};
    }
    goal.stream_end = end_of_last_page(pages, catalogue);
    if (!all_known(pages, catalogue, choice)) return goal;
    goal.complete = std::all_of(pages.begin(), pages.end(),
                                [](const Page& page) { return page.current().complete(); });
    if (!goal.stream_end) {
        goal.stream_end = last_of(pages, [](const RoundProgress& p) { return p.stream_end(); });
    }
    goal.full_round_end = last_of(pages, [](const RoundProgress& p) { return p.full_round_end(); });
    return goal;
}

std::vector<const Group*> outdated(const std::vector<Page>& pages, const Catalogue& catalogue) {
    std::vector<const Group*> old;
    for (const Page& page : pages) {
        const Group& current = page.current();
        if (page.versions.size() < 2 || !line_of(current, catalogue) || !has_shape(current)) {
            continue;
        }
        for (const Group* const group : page.versions) {
            if (line_of(*group, catalogue)) continue;
            const Contents* const contents = catalogue.of(group->sender);
            const bool replaced = contents && contents->was_replaced(group->object);
            if (replaced || current.last_seen - group->last_seen >= kForgotten) {
                old.push_back(group);
            }
        }
    }
    return old;
}

}  // namespace ellicast::receiver
