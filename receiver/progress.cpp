// receiver/progress.cpp
#include "receiver/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace ellicast::receiver {

std::string progress_text(const Session& session, Time now) {
    const SessionSummary summary = session.summary(now);
    const std::uint64_t malformed = summary.malformed.total();
    const RecordStore::Group* const shown = session.shown();
    if (!shown) {
        return malformed == 0 ? "waiting" : fmt::format("waiting; {} malformed", malformed);
    }
    const StreamCounts& counts = summary.datagrams;
    const std::uint64_t sent = counts.received - counts.duplicate + counts.lost;
    std::string text = fmt::format(
        "{} datagrams, {:.1f} % lost; {}/{} ellipsoids, {}/{} vertices", counts.received,
        sent > 0 ? 100.0 * static_cast<double>(counts.lost) / static_cast<double>(sent) : 0.0,
        shown->ellipsoids.size(), shown->hint.ellipsoids, shown->vertices.size(),
        shown->hint.vertices);
    if (malformed > 0) text += fmt::format("; {} malformed", malformed);
    return text;
}

ProgressLine::ProgressLine(bool wanted) : shown_(wanted && isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
    clear();
}

void ProgressLine::update(const std::string& text) {
    if (!shown_) return;
    // Blanks over what the last text had more.
    std::fprintf(stderr, "\r%-*s", static_cast<int>(width_), text.c_str());
    std::fflush(stderr);
    width_ = text.size();
}

void ProgressLine::clear() {
    if (!shown_ || width_ == 0) return;
    std::fprintf(stderr, "\r%-*s\r", static_cast<int>(width_), "");
    std::fflush(stderr);
    width_ = 0;
}

}  // namespace ellicast::receiver
