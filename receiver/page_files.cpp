#include "receiver/page_files.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <span>

#include "common/hex_text.hpp"
#include "common/object_id.hpp"
#include "receiver/output_files.hpp"

namespace ellicast::receiver {
namespace {

std::string digest_of(const std::string& name) {
    common::Digest digest;
    digest.update({reinterpret_cast<const std::uint8_t*>(name.data()), name.size()});
    const auto sum = digest.finish8();
    return common::hex_text(std::span(sum).first(4));
}

std::string folded(std::string text) {
    for (char& c : text) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return text;
}

}  // namespace

std::map<std::string, std::string> page_stems(const std::vector<std::string>& names,
                                              std::size_t most_bytes) {
    // Pages that are called as their file first, then by name.
    std::vector<std::pair<bool, std::string>> order;
    order.reserve(names.size());
    for (const std::string& name : names) {
        order.emplace_back(safe_file_stem(name, most_bytes) != name, name);
    }
    std::sort(order.begin(), order.end());
    order.erase(std::unique(order.begin(), order.end()), order.end());
    std::map<std::string, std::string> stems;
    std::set<std::string> taken;
    for (const auto& [changed, name] : order) {
        std::string stem = safe_file_stem(name, most_bytes);
        if (stem.empty()) stem = "page";
        const std::string plain = stem;
        for (std::string suffix = name; !taken.insert(folded(stem)).second; suffix += '#') {
            stem = plain + "-" + digest_of(suffix);
        }
        stems.emplace(name, stem);
    }
    return stems;
}

}  // namespace ellicast::receiver
