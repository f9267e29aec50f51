// common/model_file_text.hpp: tokens and numbers of text model files; private to
// common/model_file_*.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace ellicast::common {

/// Walks the tokens of a text, by lines or across them. White space separates tokens; '\n', '\r'
/// and
/// "\r\n" end a line. Never reads past the end, never allocates.
class TextScanner {
  public:
    /// `comment` starts a comment to the end of the line ('\0': no comments). With `continuation` a
    /// backslash at the end of a line joins it with the next. Lines count from `first_line`.
    explicit TextScanner(std::string_view text, char comment = '\0', bool continuation = false,
                         std::size_t first_line = 1)
        : text_(text), comment_(comment), continuation_(continuation), line_(first_line) {}

    /// Goes to the next line that has a token; false when there is none.
    bool next_line();
    /// The next token of the current line; empty at its end.
    std::string_view token();
    /// The next token, on whatever line; empty at the end of the text.
    std::string_view any_token();
    /// Drops the rest of the current line.
    void skip_line();

    [[nodiscard]] std::size_t line() const { return line_; }
    [[nodiscard]] std::size_t bytes_left() const { return text_.size() - at_; }

  private:
    [[nodiscard]] bool at_newline() const;
    void skip_blanks();  // up to a token or the end of the line
    void skip_newline();

    std::string_view text_;
    char comment_;
    bool continuation_;
    bool begun_ = false;  // next_line() has been called
    std::size_t at_ = 0;
    std::size_t line_;
};

/// A decimal number, finite and within float32's range. Throws BadModelFile naming the line.
double parse_coordinate(std::string_view token, std::size_t line);
/// The same, rounded to float32 once (not by way of double).
float parse_coordinate_float(std::string_view token, std::size_t line);
/// An integer within 64 bits. Throws BadModelFile naming the line.
std::int64_t parse_integer(std::string_view token, std::size_t line);

/// Equal but for case of ASCII letters.
bool same_word(std::string_view a, std::string_view b);
/// A token fit for an error line: printable, short, in quotes.
std::string quoted(std::string_view token);
/// "line 7: " + what, as BadModelFile.
[[noreturn]] void fail_at(std::size_t line, const std::string& what);

}  // namespace ellicast::common
