// tests/sender/decomposition_cache_test.cpp
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "common/model_io.hpp"
#include "common/object_id.hpp"
#include "sender/decomposition.hpp"
#include "tests/support/meshes.hpp"

namespace ellicast::sender {
namespace {

namespace fs = std::filesystem;
using common::Ellipsoid;

// A folder of its own, gone when the test is.
class Folder {
  public:
    Folder() {
        std::string pattern = (fs::temp_directory_path() / "ellicast-cache-XXXXXX").string();
        REQUIRE(::mkdtemp(pattern.data()) != nullptr);
        path_ = pattern;
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    Folder(Folder&&) = delete;
    Folder& operator=(Folder&&) = delete;

    [[nodiscard]] fs::path file(const std::string& name) const { return path_ / name; }

  private:
    fs::path path_;
};

const std::string kKey(32, 'a');

Decomposition some_decomposition() {
    Decomposition d;
    d.seeds = 1000;
    d.candidates = 987;
    d.covered = 0.97;
    d.outside = 0.001;
    for (int i = 0; i < 5; ++i) {
        Ellipsoid e;
        e.center = Eigen::Vector3d(i, -0.1 * i, 1e-300);
        e.L(0, 0) = 0.1 + i;
        e.L(1, 0) = -0.05;
        e.L(2, 1) = 1.0 / 3.0;
        d.ellipsoids.push_back(e);
    }
    return d;
}

std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// Puts the right checksum behind the body: what a hostile writer would do.
std::string resealed(std::string bytes) {
    bytes.resize(bytes.size() - 32);
    common::Digest digest;
    digest.update({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    const auto sum = digest.finish32();
    bytes.append(reinterpret_cast<const char*>(sum.data()), sum.size());
    return bytes;
}

TEST_CASE("what was written is read, to the bit") {
    const Folder folder;
    const Decomposition written = some_decomposition();
    write_decomposition(folder.file("d"), kKey, written);
    const auto read = read_decomposition(folder.file("d"), kKey);
    REQUIRE(read);
    CHECK(read->seeds == written.seeds);
    CHECK(read->candidates == written.candidates);
    CHECK(read->covered == written.covered);
    CHECK(read->outside == written.outside);
    REQUIRE(read->ellipsoids.size() == written.ellipsoids.size());
    for (std::size_t i = 0; i < read->ellipsoids.size(); ++i) {
        CHECK(read->ellipsoids[i].center == written.ellipsoids[i].center);
        CHECK(read->ellipsoids[i].L == written.ellipsoids[i].L);
    }
}

TEST_CASE("a decomposition without ellipsoids goes through, too") {
    const Folder folder;
    write_decomposition(folder.file("d"), kKey, {});
    const auto read = read_decomposition(folder.file("d"), kKey);
    REQUIRE(read);
    CHECK(read->ellipsoids.empty());
}

TEST_CASE("another key, a missing file and a folder give nothing") {
    const Folder folder;
    write_decomposition(folder.file("d"), kKey, some_decomposition());
    CHECK_FALSE(read_decomposition(folder.file("d"), std::string(32, 'b')));
    CHECK_FALSE(read_decomposition(folder.file("d"), "short"));
    CHECK_FALSE(read_decomposition(folder.file("missing"), kKey));
    CHECK_FALSE(read_decomposition(folder.file(""), kKey));
    CHECK_FALSE(read_decomposition("/dev/null", kKey));
}

TEST_CASE("prefixes of a file are not read, nor a file with a byte too many") {
    const Folder folder;
    write_decomposition(folder.file("d"), kKey, some_decomposition());
    const std::string bytes = bytes_of(folder.file("d"));
    for (std::size_t size = 0; size < bytes.size(); size += size < 90 ? 1 : 7) {
        write_bytes(folder.file("d"), bytes.substr(0, size));
        CHECK_FALSE(read_decomposition(folder.file("d"), kKey));
    }
    write_bytes(folder.file("d"), bytes + '\0');
    CHECK_FALSE(read_decomposition(folder.file("d"), kKey));
    write_bytes(folder.file("d"), bytes);
    CHECK(read_decomposition(folder.file("d"), kKey));
}

TEST_CASE("damaged bytes do not go unseen") {
    const Folder folder;
    write_decomposition(folder.file("d"), kKey, some_decomposition());
    const std::string bytes = bytes_of(folder.file("d"));
    for (std::size_t at = 0; at < bytes.size(); at += at < 90 ? 1 : 7) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << (at % 8)));
        write_bytes(folder.file("d"), damaged);
        CHECK_FALSE(read_decomposition(folder.file("d"), kKey));
    }
}

TEST_CASE("a right checksum does not make a lie true") {
    const Folder folder;
    // Offsets of the file's layout.
    constexpr std::size_t kCovered = 56, kCount = 72, kFirst = 80;
    const auto number = [](double value) {
        return std::string(reinterpret_cast<const char*>(&value), sizeof value);
    };
    const auto rejects = [&](const std::function<void(std::string&)>& change) {
        write_decomposition(folder.file("d"), kKey, some_decomposition());
        std::string bytes = bytes_of(folder.file("d"));
        change(bytes);
        write_bytes(folder.file("d"), resealed(bytes));
        return !read_decomposition(folder.file("d"), kKey).has_value();
    };
    CHECK_FALSE(rejects([](std::string&) {}));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {nan, infinity, -infinity}) {
        for (std::size_t scalar = 0; scalar < 9; ++scalar) {
            CHECK(rejects([&](std::string& b) { b.replace(kFirst + 8 * scalar, 8, number(bad)); }));
        }
        CHECK(rejects([&](std::string& b) { b.replace(kCovered, 8, number(bad)); }));
    }
    for (const double bad : {0.0, -1.0}) {  // diagonal of L
        for (const std::size_t scalar : {3u, 5u, 8u}) {
            CHECK(rejects([&](std::string& b) { b.replace(kFirst + 8 * scalar, 8, number(bad)); }));
        }
    }
    for (const char count : {'\0', '\4', '\6', '\377'}) {
        CHECK(rejects([&](std::string& b) { b[kCount] = count; }));
    }
    CHECK(rejects([&](std::string& b) { b.replace(kCount, 8, std::string(8, '\377')); }));
}

TEST_CASE("a later version's file is not read") {
    const Folder folder;
    write_decomposition(folder.file("d"), kKey, some_decomposition());
    std::string bytes = bytes_of(folder.file("d"));
    ++bytes[7];
    write_bytes(folder.file("d"), resealed(bytes));
    CHECK_FALSE(read_decomposition(folder.file("d"), kKey));
}

TEST_CASE("where nothing can be written, the error names the place") {
    const Folder folder;
    const fs::path path = folder.file("missing/d");
    CHECK_THROWS_AS(write_decomposition(path, kKey, {}), common::ModelError);
    try {
        write_decomposition(path, kKey, {});
    } catch (const common::ModelError& error) {
        CHECK(std::string(error.what()).find(path.string()) != std::string::npos);
    }
}

TEST_CASE("the key is a function of the solid and of what changes the result, alone") {
    const common::TriangleMesh cube = tests::cube();
    const DecompositionOptions options;
    const std::string key = decomposition_key(cube, options);
    CHECK(key.size() == 32);
    CHECK(key.find_first_not_of("0123456789abcdef") == std::string::npos);
    CHECK(decomposition_key(cube, options) == key);
    DecompositionOptions other = options;
    other.threads = 7;
    CHECK(decomposition_key(cube, other) == key);

    const std::vector<std::function<void(DecompositionOptions&)>> changes = {
        [](DecompositionOptions& o) { o.ellipsoids += 1; },
        [](DecompositionOptions& o) { o.candidates += 1; },
        [](DecompositionOptions& o) { o.criterion = Criterion::volume; },
        [](DecompositionOptions& o) { o.expected_loss += 0.01; },
        [](DecompositionOptions& o) { o.grid += 1; },
        [](DecompositionOptions& o) { o.presmooth += 1; },
        [](DecompositionOptions& o) { o.epsilon *= 1.01; },
        [](DecompositionOptions& o) { o.facet_edge *= 1.01; },
        [](DecompositionOptions& o) { o.max_aspect += 1; },
        [](DecompositionOptions& o) { o.refine += 1; },
        [](DecompositionOptions& o) { o.seed += 1; },
    };
    std::vector<std::string> keys = {key};
    for (const auto& change : changes) {
        other = options;
        change(other);
        keys.push_back(decomposition_key(cube, other));
    }
    common::TriangleMesh moved = cube;
    moved.positions[3][1] += 1e-12;
    keys.push_back(decomposition_key(moved, options));
    common::TriangleMesh turned = cube;
    std::rotate(turned.triangles[0].begin(), turned.triangles[0].begin() + 1,
                turned.triangles[0].end());
    keys.push_back(decomposition_key(turned, options));
    std::sort(keys.begin(), keys.end());
    CHECK(std::adjacent_find(keys.begin(), keys.end()) == keys.end());
}

}  // namespace
}  // namespace ellicast::sender
