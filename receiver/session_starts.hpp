// receiver/session_starts.hpp: which sessions are old, from one run of the receiver to the next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace ellicast::receiver {

/// Of each key the start of its newest session that was accepted, in microseconds since 1970 UTC by
/// the sender's clock.
class SessionStarts {
  public:
    /// A public key, or the fingerprint of a shared one.
    using Key = std::array<std::uint8_t, 32>;

    /// True when a newer session of the key is known.
    [[nodiscard]] bool is_old(const Key& key, std::uint64_t start_us) const;
    /// Keeps the newer of both.
    void note(const Key& key, std::uint64_t start_us);

    /// Goes up whenever note() changes anything.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }
    [[nodiscard]] std::size_t size() const { return newest_.size(); }

    /// A line that says what it is, then a line for each key: 64 hex digits, a blank, the
    /// microseconds.
    [[nodiscard]] std::string text() const;
    /// Takes from a text what can be read; lines that cannot be are given back by their number,
    /// from
    /// 1. A text that does not begin as it should has none to be trusted: then line 1 is given back
    /// alone.
    static SessionStarts of_text(std::string_view text, std::vector<std::size_t>& damaged);

  private:
    std::map<Key, std::uint64_t> newest_;
    std::uint64_t changes_ = 0;
};

}  // namespace ellicast::receiver
