#include "sender/page_names.hpp"

#include <set>

namespace ellicast::sender {

std::vector<std::string> page_names(const std::vector<std::filesystem::path>& paths) {
    // A number must not take the name that a later file has by itself.
    std::set<std::string> taken;
    for (const auto& path : paths) taken.insert(path.stem().string());
    std::set<std::string> given;
    std::vector<std::string> names;
    for (const auto& path : paths) {
        const std::string stem = path.stem().string();
        std::string name = stem;
        for (int number = 2; given.count(name) > 0 || (name != stem && taken.count(name) > 0);
             ++number) {
            name = stem + "-" + std::to_string(number);
        }
        given.insert(name);
        names.push_back(name);
    }
    return names;
}

}  // namespace ellicast::sender
