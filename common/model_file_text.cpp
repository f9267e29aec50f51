// common/model_file_text.cpp
#include "common/model_file_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "common/model_file_check.hpp"

namespace ellicast::common {
namespace {

// Longer ones are noise; and no number this short under- or overflows without an exponent.
constexpr std::size_t kMaxNumberLength = 128;

bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}
bool is_newline(char c) {
    return c == '\n' || c == '\r';
}

char lower(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

template <class Float>
Float parse_real(std::string_view token, std::size_t line) {
    if (token.empty()) fail_at(line, "a number is missing");
    std::string_view digits = token;
    if (digits.front() == '+') {
        digits.remove_prefix(1);
        if (digits.starts_with('-')) digits = {};
    }
    Float value = 0;
    const char* end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, value);
    if (digits.size() > kMaxNumberLength || stop != end || digits.empty() ||
        error == std::errc::invalid_argument) {
        fail_at(line, quoted(token) + " is not a number");
    }
    if (error == std::errc::result_out_of_range) {
        const bool tiny = digits.find("e-") != digits.npos || digits.find("E-") != digits.npos;
        if (!tiny) fail_at(line, quoted(token) + " is beyond the range of float32");
        return 0;
    }
    if (!std::isfinite(value)) fail_at(line, "a coordinate is not finite");
    if (std::abs(value) > std::numeric_limits<float>::max()) {
        fail_at(line, quoted(token) + " is beyond the range of float32");
    }
    return value;
}

}  // namespace

bool TextScanner::at_newline() const {
    return at_ < text_.size() && is_newline(text_[at_]);
}

void TextScanner::skip_newline() {
    if (!at_newline()) return;
    if (text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n') ++at_;
    ++at_;
    ++line_;
}

void TextScanner::skip_blanks() {
    while (at_ < text_.size()) {
        const char c = text_[at_];
        if (is_blank(c)) {
            ++at_;
        } else if (comment_ != '\0' && c == comment_) {
            while (at_ < text_.size() && !is_newline(text_[at_])) ++at_;
        } else if (continuation_ && c == '\\' && at_ + 1 < text_.size() &&
                   is_newline(text_[at_ + 1])) {
            ++at_;
            skip_newline();
        } else {
            return;
        }
    }
}

bool TextScanner::next_line() {
    if (begun_) skip_line();
    begun_ = true;
    for (;;) {
        skip_blanks();
        if (at_ >= text_.size()) return false;
        if (!at_newline()) return true;
        skip_newline();
    }
}

std::string_view TextScanner::token() {
    skip_blanks();
    const std::size_t first = at_;
    while (at_ < text_.size() && !is_blank(text_[at_]) && !is_newline(text_[at_])) ++at_;
    return text_.substr(first, at_ - first);
}

std::string_view TextScanner::any_token() {
    for (;;) {
        const std::string_view found = token();
        if (!found.empty() || at_ >= text_.size()) return found;
        skip_newline();
    }
}

void TextScanner::skip_line() {
    while (!token().empty()) {
    }
    skip_newline();
}

double parse_coordinate(std::string_view token, std::size_t line) {
    return parse_real<double>(token, line);
}

float parse_coordinate_float(std::string_view token, std::size_t line) {
    return parse_real<float>(token, line);
}

std::int64_t parse_integer(std::string_view token, std::size_t line) {
    if (token.empty()) fail_at(line, "a number is missing");
    std::int64_t value = 0;
    const char* end = token.data() + token.size();
    const auto [stop, error] = std::from_chars(token.data(), end, value);
    if (stop != end || error != std::errc()) {
        fail_at(line, quoted(token) + " is not an integer");
    }
    return value;
}

bool same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](char x, char y) { return lower(x) == lower(y); });
}

std::string quoted(std::string_view token) {
    constexpr std::size_t kShown = 24;
    std::string result = "'";
    for (const char c : token.substr(0, kShown)) result += c > ' ' && c <= '~' ? c : '?';
    return result + (token.size() > kShown ? "...'" : "'");
}

void fail_at(std::size_t line, const std::string& what) {
    throw BadModelFile("line " + std::to_string(line) + ": " + what);
}

}  // namespace ellicast::common
