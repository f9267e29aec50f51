// common/key_file.cpp
#include "common/key_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <optional>
#include <system_error>

#include "common/file_descriptor.hpp"
#include "common/hex_text.hpp"

namespace ellicast::common {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostText = 1024;  // no key file is longer

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
    throw KeyError("'" + path.string() + "': " + reason);
}
[[noreturn]] void fail(const fs::path& path, int error) {
    fail(path, std::generic_category().message(error));
}

/// A file's text without blanks at its ends.
struct KeyText {
    std::string text;
    bool everybody_reads = false;
};

KeyText read_text(const fs::path& path) {
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0) fail(path, errno);
    struct stat status {};
    if (::fstat(file.get(), &status) != 0) fail(path, errno);
    if (S_ISDIR(status.st_mode)) fail(path, EISDIR);
    std::string text(kMostText + 1, '\0');
    std::size_t size = 0;
    while (size < text.size()) {
        const ssize_t got = ::read(file.get(), text.data() + size, text.size() - size);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) fail(path, errno);
        if (got == 0) break;
        size += static_cast<std::size_t>(got);
    }
    text.resize(size);
    const auto blank = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
    while (!text.empty() && blank(text.back())) text.pop_back();
    std::size_t first = 0;
    while (first < text.size() && blank(text[first])) ++first;
    // A pipe has no mode to speak of.
    return {text.substr(first), S_ISREG(status.st_mode) && (status.st_mode & S_IROTH) != 0};
}

/// The bytes of a secret key; empty when the text is no hex digits, so many.
template <std::size_t N>
std::optional<std::array<std::uint8_t, N>> read_secret(const fs::path& path, KeyText& key) {
    const auto bytes = bytes_of_hex<N>(key.text);
    wipe({reinterpret_cast<std::uint8_t*>(key.text.data()), key.text.size()});
    if (bytes && key.everybody_reads) {
        fail(path, "everybody can read this secret key; chmod 600 it");
    }
    return bytes;
}

bool is_there(const fs::path& path) {
    struct stat status {};
    return ::lstat(path.c_str(), &status) == 0;
}

constexpr const char* kNotReplaced = "exists already; --force replaces it";

/// Through a temporary file beside it, which only its owner can read from the start.
void write_line(const fs::path& path, const std::string& hex, mode_t mode, bool replace) {
    std::string temporary = path.string() + ".XXXXXX";
    const FileDescriptor file(::mkstemp(temporary.data()));
    if (file.get() < 0) fail(path, errno);
    const auto give_up = [&](int error) {
        ::unlink(temporary.c_str());
        if (error == EEXIST) fail(path, kNotReplaced);
        fail(path, error);
    };
    const std::string line = hex + "\n";
    if (::write(file.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
        give_up(errno == 0 ? EIO : errno);
    }
    if (::fchmod(file.get(), mode) != 0 || ::fsync(file.get()) != 0) give_up(errno);
    if (replace) {
        if (::rename(temporary.c_str(), path.c_str()) != 0) give_up(errno);
        return;
    }
    // Unlike rename, link never takes an existing file's place.
    if (::link(temporary.c_str(), path.c_str()) != 0) give_up(errno);
    ::unlink(temporary.c_str());
}

mode_t public_mode() {
    const mode_t mask = ::umask(0);
    ::umask(mask);
    return mode_t{0644} & ~mask;
}

}  // namespace

PublicKey read_public_key(const std::string& text) {
    if (const auto key = bytes_of_hex<32>(text)) return *key;
    const std::string content = read_text(text).text;
    if (const auto key = bytes_of_hex<32>(content)) return *key;
    if (bytes_of_hex<64>(content)) {
        fail(text, "is a private key; its public one, a file in .pub, is what is needed");
    }
    fail(text, "is not a public key, one line of 64 hex digits");
}

SigningKey read_signing_key(const std::filesystem::path& path) {
    KeyText text = read_text(path);
    const bool half = bytes_of_hex<32>(text.text).has_value();
    const auto bytes = read_secret<SigningKey::kBytes>(path, text);
    if (half) fail(path, "is no private key; a public or shared one has 64 hex digits");
    if (!bytes) fail(path, "is not a private key, one line of 128 hex digits");
    const auto key = SigningKey::of_bytes(*bytes);
    if (!key) fail(path, "is damaged: its halves do not belong together");
    return *key;
}

SharedKey read_shared_key(const std::filesystem::path& path) {
    KeyText text = read_text(path);
    const auto bytes = read_secret<SharedKey::kBytes>(path, text);
    if (!bytes) fail(path, "is not a shared key, one line of 64 hex digits (no passphrases)");
    return SharedKey(*bytes);
}

void write_signing_key(const std::filesystem::path& path, const SigningKey& key, bool replace) {
    const fs::path shown = path.string() + ".pub";
    for (const fs::path& file : {path, shown}) {
        if (!replace && is_there(file)) fail(file, kNotReplaced);
    }
    write_line(path, hex_text(key.bytes()), S_IRUSR | S_IWUSR, replace);
    write_line(shown, hex_text(key.public_key()), public_mode(), replace);
}

void write_shared_key(const std::filesystem::path& path, const SharedKey& key, bool replace) {
    write_line(path, hex_text(key.bytes()), S_IRUSR | S_IWUSR, replace);
}

}  // namespace ellicast::common
