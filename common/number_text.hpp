// common/number_text.hpp: what the parsers of users' texts share.
#pragma once

#include <charconv>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace ellicast::common {

/// The whole word as a plain decimal number, or nothing: no blanks, no '+', no hexadecimals, in T's
/// range. For floating-point T "nan" and "inf" pass; compare so that they fail.
template <class T>
std::optional<T> number(std::string_view word) {
    T value{};
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (word.empty() || error != std::errc{} || stop != end) return std::nullopt;
    return value;
}

/// One line: the text in quotes, then why it is refused.
inline std::invalid_argument refusal(std::string_view text, std::string_view reason) {
    std::string line("'");
    line.append(text).append("': ").append(reason);
    return std::invalid_argument(line);
}

}  // namespace ellicast::common
