#include "receiver/session_starts.hpp"

#include <catch2/catch.hpp>

namespace {

using namespace ellicast::receiver;

SessionStarts read(const std::string& text, const std::vector<std::size_t>& damaged) {
    std::vector<std::size_t> found;
    SessionStarts starts = SessionStarts::of_text(text, found);
    CHECK(found == damaged);
    return starts;
}

const std::string kTitle = "ellicast session starts 1\n";
constexpr SessionStarts::Key kA{0xaa};
constexpr SessionStarts::Key kB{0xbb};

}  // namespace

TEST_CASE("the newest start of each key stays") {
    SessionStarts starts;
    CHECK_FALSE(starts.is_old(kA, 0));
    starts.note(kA, 100);
    starts.note(kA, 50);
    starts.note(kB, 7);
    CHECK(starts.is_old(kA, 99));
    CHECK_FALSE(starts.is_old(kA, 100));
    CHECK_FALSE(starts.is_old(kB, 7));
    CHECK(starts.size() == 2);
}

TEST_CASE("changes are told from repetitions") {
    SessionStarts starts;
    starts.note(kA, 0);
    const auto first = starts.changes();
    CHECK(first > 0);
    starts.note(kA, 0);
    CHECK(starts.changes() == first);
    starts.note(kA, 1);
    CHECK(starts.changes() > first);
}

TEST_CASE("starts survive a file") {
    SessionStarts starts;
    starts.note(kA, 1'700'000'000'000'000);
    starts.note(kB, ~std::uint64_t{0});
    const std::string text = starts.text();
    CHECK(text.starts_with(kTitle + "aa00"));
    const SessionStarts again = read(text, {});
    CHECK(again.text() == text);
    CHECK(again.is_old(kA, 1'699'999'999'999'999));
    CHECK(read(SessionStarts().text(), {}).size() == 0);
}

TEST_CASE("of a damaged file what is whole is taken, and the rest is named") {
    SessionStarts starts;
    starts.note(kA, 100);
    starts.note(kB, 200);
    const std::string text = starts.text();
    const std::size_t second = text.find("bb");

    std::string cut = text;
    cut.resize(cut.size() - 2);  // in the midst of a number
    CHECK(read(cut, {3}).size() == 1);
    cut = text;
    cut.pop_back();  // who knows whether a digit is gone with it
    CHECK(read(cut, {3}).size() == 1);

    std::string dirty = text;
    dirty[second] = 'x';
    CHECK(read(dirty, {3}).is_old(kA, 99));
    dirty = text;
    dirty[second + 64] = '9';
    CHECK(read(dirty, {3}).size() == 1);
    CHECK(read(kTitle + "\n" + text.substr(kTitle.size()), {2}).size() == 2);
    CHECK(read(kTitle + std::string(64, 'a') + " -5\n", {2}).size() == 0);
    CHECK(read(kTitle + std::string(64, 'a') + " 99999999999999999999999\n", {2}).size() == 0);

    CHECK(read("something else\n" + text, {1}).size() == 0);
    CHECK(read(std::string(5000, '\0'), {1}).size() == 0);
    CHECK(read("", {}).size() == 0);
}
