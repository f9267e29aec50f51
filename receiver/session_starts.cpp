// receiver/session_starts.cpp
#include "receiver/session_starts.hpp"

#include <optional>

#include "common/hex_text.hpp"
#include "common/number_text.hpp"

namespace ellicast::receiver {
namespace {

constexpr std::string_view kTitle = "ellicast session starts 1";

struct Line {
    SessionStarts::Key key{};
    std::uint64_t start_us = 0;
};

std::optional<Line> line_of(std::string_view text) {
    Line line;
    const std::size_t digits = 2 * line.key.size();
    if (text.size() < digits + 2 || text[digits] != ' ') return std::nullopt;
    const auto key = common::bytes_of_hex<32>(text.substr(0, digits));
    const auto start = common::number<std::uint64_t>(text.substr(digits + 1));
    if (!key || !start) return std::nullopt;
    return Line{*key, *start};
}

}  // namespace

bool SessionStarts::is_old(const Key& key, std::uint64_t start_us) const {
    const auto known = newest_.find(key);
    return known != newest_.end() && start_us < known->second;
}

void SessionStarts::note(const Key& key, std::uint64_t start_us) {
    const auto [known, is_new] = newest_.try_emplace(key, start_us);
    if (!is_new && known->second >= start_us) return;
    known->second = start_us;
    ++changes_;
}

std::string SessionStarts::text() const {
    std::string text(kTitle);
    text += '\n';
    for (const auto& [key, start_us] : newest_) {
        text += common::hex_text(key) + ' ' + std::to_string(start_us) + '\n';
    }
    return text;
}

SessionStarts SessionStarts::of_text(std::string_view text, std::vector<std::size_t>& damaged) {
    SessionStarts starts;
    for (std::size_t number = 1; !text.empty(); ++number) {
        const std::size_t end = text.find('\n');
        const std::string_view words = text.substr(0, end);
        // A last line without its end was cut off somewhere: its number may be.
        const bool whole = end != std::string_view::npos;
        text.remove_prefix(whole ? end + 1 : text.size());
        if (number == 1) {
            if (whole && words == kTitle) continue;
            damaged.push_back(1);
            return starts;
        }
        const auto line = whole ? line_of(words) : std::nullopt;
        if (line) {
            starts.note(line->key, line->start_us);
        } else {
            damaged.push_back(number);
        }
    }
    return starts;
}

}  // namespace ellicast::receiver
