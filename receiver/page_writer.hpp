#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "receiver/page_result.hpp"
#include "receiver/session.hpp"

namespace ellicast::receiver {

/// Whether a page is to be written now: when it is complete, or a round of it has ended, and
/// since it was written other records have come. Pure.
class PageSchedule {
  public:
    /// `written` is the page's last result, null before there is one.
    [[nodiscard]] static bool due(const RecordStore::Group& group, const PageResult* written,
                                  std::uint64_t rounds_written);
};

struct PageWriterOptions {
    std::filesystem::path directory;
    int grid = 96;
    bool conceal = true;
    std::size_t most_name_bytes = 100;
};

/// Keeps the files of a carousel's pages while it is received, so that who listens forever has
/// them: one at a time, on a thread of its own. A page's file is replaced as a whole.
class PageWriter {
  public:
    explicit PageWriter(PageWriterOptions options);
    /// Gives up the page in the making.
    ~PageWriter();
    PageWriter(const PageWriter&) = delete;
    PageWriter& operator=(const PageWriter&) = delete;

    /// Takes a finished page in and begins the next one that is due, no sooner after the last one's
    /// end than that took. Cost: a copy of the page's records when one begins.
    void on_tick(Time now, const Session& session);

    /// The last result of each page by name.
    [[nodiscard]] const std::map<std::string, PageResult>& written() const { return written_; }

  private:
    void take(Time now);
    void start(Time now, const Page& page, const std::vector<Page>& all);

    PageWriterOptions options_;
    std::map<std::string, PageResult> written_;
    std::map<std::string, std::uint64_t> rounds_;  // that were over when it was written
    Time begun_{};
    Time rests_until_{};
    std::atomic<bool> stop_{false};
    std::future<std::optional<PageResult>> pending_;
};

/// The task for a page among all: file names are those of page_stems.
PageTask task_of(const Page& page, const std::vector<Page>& all,
                 const std::filesystem::path& directory, std::size_t most_name_bytes);

}  // namespace ellicast::receiver
