#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ellicast::sender {

/// What the pages of a carousel are called: the stem of each path. Where an earlier page has the
/// name already, a number is added: a, a-2, a-3. All differ. A function of the paths alone.
std::vector<std::string> page_names(const std::vector<std::filesystem::path>& paths);

}  // namespace ellicast::sender
