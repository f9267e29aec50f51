// tests/sender/model_watch_test.cpp: with real files, for file systems are what it is about.
#include "sender/model_watch.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "tests/sender/made_objects.hpp"
#include "tests/support/child_process.hpp"

namespace ellicast::sender {
namespace {

using namespace std::chrono_literals;

void write(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path) << text;
}

/// Two files; "loading" one makes an object out of the number in it, and throws when there is none.
struct Place {
    tests::TemporaryDirectory directory;
    std::vector<std::filesystem::path> paths{directory.path() / "a", directory.path() / "b"};
    std::shared_ptr<std::atomic<int>> loads = std::make_shared<std::atomic<int>>(0);

    Place() {
        write(paths[0], "1");
        write(paths[1], "2");
    }
    [[nodiscard]] std::unique_ptr<ModelWatch> watch() const {
        std::vector<std::optional<FileStamp>> stamps;
        std::vector<protocol::ObjectId> ids;
        for (std::size_t page = 0; page < paths.size(); ++page) {
            stamps.push_back(stamp_of(paths[page]));
            ids.push_back(tests::made_object(5, 50, page + 1).id);
        }
        // By value: the thread may outlive us.
        const auto made = [copy = paths, counter = loads](std::size_t page) {
            ++*counter;
            const std::string text = tests::read_file(copy[page]);
            if (text.empty() || text[0] < '0' || text[0] > '9') throw std::runtime_error("broken");
            PlanOptions options;
            options.paged = true;
            return FreshPage{page, LoadedModel{},
                             RoundPlan(tests::made_object(5, 50, std::stoul(text)), options)};
        };
        return std::make_unique<ModelWatch>(paths, stamps, ids, made);
    }
};

/// What becomes ready, within a generous time.
std::vector<FreshPage> await(ModelWatch& watch) {
    const auto deadline = std::chrono::steady_clock::now() + 20s;
    for (;;) {
        std::vector<FreshPage> fresh = watch.take();
        if (!fresh.empty() || std::chrono::steady_clock::now() > deadline) return fresh;
        std::this_thread::sleep_for(5ms);
    }
}

void await_loads(const Place& place, int count) {
    const auto deadline = std::chrono::steady_clock::now() + 20s;
    while (*place.loads < count && std::chrono::steady_clock::now() < deadline) {
        std::this_thread::sleep_for(5ms);
    }
    REQUIRE(*place.loads >= count);
}

}  // namespace

TEST_CASE("a stamp tells files apart, and a missing one from all") {
    const Place place;
    CHECK(stamp_of(place.paths[0]) == stamp_of(place.paths[0]));
    CHECK(stamp_of(place.paths[0]) != stamp_of(place.paths[1]));
    CHECK_FALSE(stamp_of(place.directory.path() / "none"));
}

TEST_CASE("a file that changes is read again, the others are not") {
    const Place place;
    const auto watch = place.watch();
    write(place.paths[1], "34");
    watch->check(false);
    const std::vector<FreshPage> fresh = await(*watch);
    REQUIRE(fresh.size() == 1);
    CHECK(fresh[0].page == 1);
    CHECK(fresh[0].plan.object().id == tests::made_object(5, 50, 34).id);
    CHECK(*place.loads == 1);
}

TEST_CASE("a file put in the place of another is read, of the same size and time as well") {
    const Place place;
    const auto watch = place.watch();
    write(place.directory.path() / "new", "7");
    std::filesystem::last_write_time(place.directory.path() / "new",
                                     std::filesystem::last_write_time(place.paths[0]));
    std::filesystem::rename(place.directory.path() / "new", place.paths[0]);
    watch->check(false);
    const std::vector<FreshPage> fresh = await(*watch);
    REQUIRE(fresh.size() == 1);
    CHECK(fresh[0].page == 0);
}

TEST_CASE("a broken file gives nothing and is tried once, and a sound one after it is taken") {
    const Place place;
    const auto watch = place.watch();
    write(place.paths[0], "no number");
    watch->check(false);
    await_loads(place, 1);
    watch->check(false);
    write(place.paths[1], "5");
    watch->check(false);
    REQUIRE(await(*watch).size() == 1);
    CHECK(*place.loads == 2);
    write(place.paths[0], "61");
    watch->check(false);
    const std::vector<FreshPage> fresh = await(*watch);
    REQUIRE(fresh.size() == 1);
    CHECK(fresh[0].page == 0);
}

TEST_CASE("reading all again gives nothing when nothing changed") {
    const Place place;
    const auto watch = place.watch();
    watch->check(true);
    await_loads(place, 2);
    write(place.paths[0], "8");
    watch->check(true);
    const std::vector<FreshPage> fresh = await(*watch);
    REQUIRE(fresh.size() == 1);
    CHECK(fresh[0].page == 0);
}

TEST_CASE("a missing file is no news for the session") {
    const Place place;
    const auto watch = place.watch();
    std::filesystem::remove(place.paths[0]);
    write(place.paths[1], "9");
    watch->check(false);
    const std::vector<FreshPage> fresh = await(*watch);
    REQUIRE(fresh.size() == 1);
    CHECK(fresh[0].page == 1);
}

}  // namespace ellicast::sender
