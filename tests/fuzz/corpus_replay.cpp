// tests/fuzz/corpus_replay.cpp: a fuzz target's corpus as a plain test.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

TEST_CASE("every file of the corpus is taken without harm") {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(ELLICAST_CORPUS)) {
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    REQUIRE_FALSE(files.empty());
    for (const std::filesystem::path& path : files) {
        CAPTURE(path.filename().string());
        std::ifstream file(path, std::ios::binary);
        REQUIRE(file);
        const std::vector<char> content(std::istreambuf_iterator<char>(file), {});
        const std::vector<std::uint8_t> bytes(content.begin(), content.end());  // exact size
        CHECK(LLVMFuzzerTestOneInput(bytes.data(), bytes.size()) == 0);
    }
}
