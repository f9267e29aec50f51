#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sender/model_loading.hpp"
#include "sender/round_plan.hpp"

namespace ellicast::sender {

/// By what a file is known to be another one than before, without reading it.
struct FileStamp {
    std::uint64_t device = 0;
    std::uint64_t inode = 0;
    std::uint64_t bytes = 0;
    std::int64_t modified_ns = 0;
    bool operator==(const FileStamp&) const = default;
};
/// Empty when there is no such file, or nobody lets us look.
std::optional<FileStamp> stamp_of(const std::filesystem::path& path);

/// A page's new object, ready to be sent.
struct FreshPage {
    std::size_t page = 0;
    LoadedModel model;  // its object is in the plan
    RoundPlan plan;
};

/// Reads models again whose files have changed, on a thread of its own with low priority, so that
/// the sending thread neither waits for a disk nor for geometry. A file that still changes is let
/// rest first; one that cannot be used is complained about once, in the log, and the page keeps its
/// object, as it does when the new file makes the same one.
class ModelWatch {
  public:
    /// Runs on the other thread. May throw std::exception: why the file cannot be used.
    using Load = std::function<FreshPage(std::size_t page)>;

    /// The stamps are those that the files had before they were read for the first time, the ids
    /// those of the objects made of them; one each for every path, in page order (asserted).
    ModelWatch(std::vector<std::filesystem::path> paths,
               std::vector<std::optional<FileStamp>> stamps,
               std::vector<protocol::ObjectId> objects, Load load);
    /// Waits for no model: one in the making is left to the thread, which goes on by itself. See
    /// busy().
    ~ModelWatch();
    ModelWatch(const ModelWatch&) = delete;
    ModelWatch& operator=(const ModelWatch&) = delete;

    /// Has the files looked at; with `all` read again whatever their stamps say. Never blocks.
    void check(bool all);
    /// What has become ready. Never blocks for long.
    std::vector<FreshPage> take();
    /// Gives up what is large where nobody waits for it.
    void discard(std::vector<RoundPlan> plans);
    /// The thread has work. Whoever ends the program then must do it without static destructors,
    /// which that thread may still need.
    [[nodiscard]] bool busy() const;

  private:
    struct Shared;
    std::shared_ptr<Shared> shared_;
    std::thread thread_;
};

}  // namespace ellicast::sender
