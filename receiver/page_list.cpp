#include "receiver/page_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "receiver/output_files.hpp"
#include "receiver/report.hpp"

namespace ellicast::receiver {
namespace {

using Group = RecordStore::Group;

/// The latest group of each sender that tells no contents.
std::map<SenderKey, const Group*> alone(const Session& session) {
    std::map<SenderKey, const Group*> latest;
    for (const Group& group : session.store().groups()) {
        if (session.catalogue().of(group.sender)) continue;
        const auto [known, fresh] = latest.try_emplace(group.sender, &group);
        if (!fresh && group.last_seen > known->second->last_seen) known->second = &group;
    }
    return latest;
}

ListedPage listed(const protocol::PageEntry& line) {
    return {.page = line.page,
            .pages = line.pages,
            .name = line.name,
            .object = line.object,
            .version = line.version,
            .ellipsoids = line.ellipsoids,
            .vertices = line.vertices,
            .components = line.components,
            .euler_all = line.euler_all};
}

ListedPage listed(const Group& group, const Catalogue& catalogue) {
    return {.page = 0,
            .pages = 1,
            .name = page_name(group, catalogue),
            .object = group.object,
            .version = 1,
            .ellipsoids = group.hint.ellipsoids,
            .vertices = group.hint.vertices,
            .components = group.hint.components,
            .euler_all = group.hint.euler_all};
}

}  // namespace

std::vector<ListedPage> listed_pages(const Session& session) {
    std::map<SenderKey, std::vector<ListedPage>> by_sender;
    for (const Contents& contents : session.catalogue().all()) {
        for (const auto& [page, line] : contents.lines) {
            by_sender[contents.sender].push_back(listed(line));
        }
    }
    for (const auto& [sender, group] : alone(session)) {
        by_sender[sender].push_back(listed(*group, session.catalogue()));
    }
    std::vector<ListedPage> all;
    for (const auto& [sender, pages] : by_sender) all.insert(all.end(), pages.begin(), pages.end());
    return all;
}

bool lists_all(const Session& session) {
    const std::vector<Contents>& contents = session.catalogue().all();
    const auto others = alone(session);
    return !(contents.empty() && others.empty()) &&
           std::all_of(contents.begin(), contents.end(),
                       [](const Contents& c) { return c.complete(); }) &&
           std::all_of(others.begin(), others.end(),
                       [](const auto& other) { return other.second->description.has_value(); });
}

std::string list_text(const std::vector<ListedPage>& pages) {
    std::size_t width = 4;
    for (const ListedPage& page : pages) width = std::max(width, page.name.size());
    std::string text =
        fmt::format("{:>7}  {:{}}  {:16}  {:>7}  {:>10}  {:>9}  {:>10}  {:>5}\n", "PAGE", "NAME",
                    width, "ID", "VERSION", "ELLIPSOIDS", "VERTICES", "COMPONENTS", "GENUS");
    for (const ListedPage& page : pages) {
        text += fmt::format("{:>7}  {:{}}  {:16}  {:>7}  {:>10}  {:>9}  {:>10}  {:>5}\n",
                            fmt::format("{}/{}", page.page + 1, page.pages), page.name, width,
                            id_text(page.object), page.version, page.ellipsoids, page.vertices,
                            page.components, page.genus());
    }
    return text;
}

nlohmann::ordered_json list_json(const std::vector<ListedPage>& pages) {
    nlohmann::ordered_json json;
    json["program"] = "ellicast-recv";
    json["version"] = program_version();
    json["pages"] = nlohmann::ordered_json::array();
    for (const ListedPage& page : pages) {
        json["pages"].push_back({{"page", page.page},
                                 {"pages", page.pages},
                                 {"name", page.name},
                                 {"object_id", id_text(page.object)},
                                 {"version", page.version},
                                 {"ellipsoids", page.ellipsoids},
                                 {"vertices", page.vertices},
                                 {"components", page.components},
                                 {"genus", page.genus()}});
    }
    return json;
}

void write_list(const std::filesystem::path& path, const std::vector<ListedPage>& pages) {
    write_json(path, list_json(pages));
}

}  // namespace ellicast::receiver
