#include "common/key_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "common/hex_text.hpp"
#include "tests/support/child_process.hpp"

namespace {

using namespace ellicast::common;
namespace fs = std::filesystem;
using Catch::Matchers::Contains;

struct Folder {
    ellicast::tests::TemporaryDirectory directory;
    [[nodiscard]] fs::path path(const char* name) const { return directory.path() / name; }
    /// A file that its owner alone can read.
    [[nodiscard]] fs::path file(const char* name, const std::string& text,
                                mode_t mode = 0600) const {
        std::ofstream(path(name)) << text;
        REQUIRE(::chmod(path(name).c_str(), mode) == 0);
        return path(name);
    }
    [[nodiscard]] std::size_t files() const {
        std::size_t count = 0;
        for ([[maybe_unused]] const auto& entry : fs::directory_iterator(directory.path())) ++count;
        return count;
    }
};

mode_t mode_of(const fs::path& path) {
    struct stat status {};
    REQUIRE(::stat(path.c_str(), &status) == 0);
    return status.st_mode & 07777;
}

const std::string kHex64(64, 'a');

}  // namespace

TEST_CASE("a pair comes back from its files, which only its owner can read") {
    const Folder folder;
    const SigningKey key = SigningKey::random();
    const mode_t mask = ::umask(0);  // even then
    write_signing_key(folder.path("studio"), key, false);
    ::umask(mask);
    CHECK(mode_of(folder.path("studio")) == 0600);
    CHECK(mode_of(folder.path("studio.pub")) == 0644);
    CHECK(read_signing_key(folder.path("studio")).bytes() == key.bytes());
    CHECK(read_public_key(folder.path("studio.pub").string()) == key.public_key());
    const std::string line = ellicast::tests::read_file(folder.path("studio.pub"));
    CHECK(line == hex_text(key.public_key()) + "\n");
    CHECK(line.size() == 65);
    CHECK(read_public_key(line.substr(0, 64)) == key.public_key());
    CHECK(folder.files() == 2);
}

TEST_CASE("a shared key comes back from its file") {
    const Folder folder;
    const SharedKey key = SharedKey::random();
    write_shared_key(folder.path("team"), key, false);
    CHECK(mode_of(folder.path("team")) == 0600);
    CHECK(read_shared_key(folder.path("team")).bytes() == key.bytes());
    CHECK(folder.files() == 1);
}

TEST_CASE("no key is written over a file unless told to") {
    const Folder folder;
    const SigningKey key = SigningKey::random();
    SECTION("the private one is there") {
        (void)folder.file("studio", "old\n");
    }
    SECTION("the public one is there") {
        (void)folder.file("studio.pub", "old\n");
    }
    SECTION("a link to nowhere is there") {
        fs::create_symlink("nowhere", folder.path("studio"));
    }
    CHECK_THROWS_WITH(write_signing_key(folder.path("studio"), key, false),
                      Contains(folder.path("studio").string()) && Contains("exists already"));
    CHECK(folder.files() == 1);
    write_signing_key(folder.path("studio"), key, true);
    CHECK(read_signing_key(folder.path("studio")).bytes() == key.bytes());
    CHECK(mode_of(folder.path("studio")) == 0600);
    CHECK(folder.files() == 2);
}

TEST_CASE("a place where no key can be written is named") {
    const Folder folder;
    CHECK_THROWS_WITH(
        write_signing_key(folder.path("none") / "key", SigningKey::random(), false),
        Contains((folder.path("none") / "key").string()) && Contains("No such file or directory"));
}

TEST_CASE("secret keys that everybody can read are refused, those of a group are not") {
    const Folder folder;
    const auto shared = folder.file("psk", kHex64 + "\n", 0644);
    CHECK_THROWS_WITH(read_shared_key(shared), Contains(shared.string()) &&
                                                   Contains("everybody can read") &&
                                                   Contains("chmod 600"));
    REQUIRE(::chmod(shared.c_str(), 0640) == 0);
    CHECK(read_shared_key(shared).bytes()[31] == 0xaa);
    const auto key = folder.file("key", hex_text(SigningKey::random().bytes()), 0604);
    CHECK_THROWS_WITH(read_signing_key(key), Contains("everybody can read"));
}

TEST_CASE("what is no key is refused with its name and the reason") {
    const Folder folder;
    const std::string pair = hex_text(SigningKey::random().bytes());
    SECTION("a private key") {
        std::string damaged = pair;
        damaged[5] = damaged[5] == '0' ? '1' : '0';
        const std::vector<std::pair<std::string, std::string>> files{
            {"", "128 hex digits"},
            {kHex64, "no private key"},
            {pair.substr(1), "128 hex digits"},
            {pair + "0", "128 hex digits"},
            {std::string(128, 'x'), "128 hex digits"},
            {std::string(1 << 20, 'a'), "128 hex digits"},
            {pair.substr(0, 64) + "\n" + pair.substr(64), "128 hex digits"},
            {damaged, "damaged"}};
        for (const auto& [text, reason] : files) {
            const auto path = folder.file("bad", text);
            CAPTURE(text.substr(0, 200));
            CHECK_THROWS_WITH(read_signing_key(path), Contains(path.string()) && Contains(reason));
        }
    }
    SECTION("a shared key") {
        for (const std::string& text : {std::string("correct horse battery staple"), pair,
                                        kHex64.substr(1), kHex64 + "a", std::string()}) {
            const auto path = folder.file("bad", text);
            CAPTURE(text);
            CHECK_THROWS_WITH(read_shared_key(path),
                              Contains(path.string()) && Contains("64 hex digits"));
        }
    }
    SECTION("a public key") {
        const auto secret = folder.file("studio", pair);
        CHECK_THROWS_WITH(read_public_key(secret.string()), Contains("is a private key"));
        const auto junk = folder.file("junk", kHex64.substr(2) + "zz");
        CHECK_THROWS_WITH(read_public_key(junk.string()), Contains("not a public key"));
    }
    SECTION("a name of nothing, or of a folder") {
        CHECK_THROWS_WITH(read_public_key("no-such-file"),
                          Contains("'no-such-file'") && Contains("No such file"));
        CHECK_THROWS_WITH(read_signing_key(folder.directory.path()), Contains("Is a directory"));
    }
}

TEST_CASE("blanks around a key do not matter, capitals neither") {
    const Folder folder;
    const auto path = folder.file("psk", "\n  " + std::string(64, 'B') + " \r\n\n");
    CHECK(read_shared_key(path).bytes()[0] == 0xbb);
}
