// receiver/progress.hpp
#pragma once

#include <cstddef>
#include <string>

#include "receiver/arrival.hpp"
#include "receiver/session.hpp"

namespace ellicast::receiver {

/// What a session has so far, in one line without its end.
std::string progress_text(const Session& session, Time now);

/// One line on stderr that is written over again and again, when stderr is a terminal; else
/// nothing.
class ProgressLine {
  public:
    explicit ProgressLine(bool wanted);
    ~ProgressLine();
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;

    [[nodiscard]] bool shown() const { return shown_; }
    void update(const std::string& text);
    /// Leaves an empty line for whatever is printed next.
    void clear();

  private:
    bool shown_;
    std::size_t width_ = 0;
};

}  // namespace ellicast::receiver
