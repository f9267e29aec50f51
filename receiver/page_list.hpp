#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "receiver/session.hpp"

namespace ellicast::receiver {

/// One line of what is on air.
struct ListedPage {
    std::uint16_t page = 0;
    std::uint16_t pages = 1;
    std::string name;
    protocol::ObjectId object{};
    std::uint32_t version = 1;
    std::uint32_t ellipsoids = 0;
    std::uint32_t vertices = 0;
    std::uint32_t components = 1;
    std::int32_t euler_all = 2;

    [[nodiscard]] std::int64_t genus() const { return std::int64_t{components} - euler_all / 2; }
};

/// What is on air as far as it was heard: every line of every sender's contents, by sender and
/// page; of a sender without contents its latest object, as its hint and description say.
std::vector<ListedPage> listed_pages(const Session& session);

/// Whether something was heard, and from every sender its whole contents or, where it tells none,
/// a description.
bool lists_all(const Session& session);

/// A table with a line of headings.
std::string list_text(const std::vector<ListedPage>& pages);

/// {program, version, pages: [{page, pages, name, object_id, version, ellipsoids, vertices,
/// components, genus}]}
nlohmann::ordered_json list_json(const std::vector<ListedPage>& pages);

/// Atomic. Throws common::ModelError with the path and the reason.
void write_list(const std::filesystem::path& path, const std::vector<ListedPage>& pages);

}  // namespace ellicast::receiver
