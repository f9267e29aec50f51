// common/atomic_file.cpp
#include "common/atomic_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "common/file_descriptor.hpp"

namespace ellicast::common {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(int error) {
    throw WriteFailure(std::generic_category().message(error));
}

void write(const FileDescriptor& file, std::string_view bytes) {
    while (!bytes.empty()) {
        const ::ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail(errno);
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
}

void close(FileDescriptor& file) {  // some file systems report a full disk only here
    if (::close(file.release()) != 0) fail(errno);
}

void write_directly(const fs::path& path, std::string_view bytes) {
    FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!file.valid()) fail(errno);
    write(file, bytes);
    close(file);
}

// A name nobody has: the process and a counter, tried exclusively.
fs::path temporary_beside(const fs::path& path, int attempt) {
    const std::string suffix =
        ".part-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    return path.parent_path() / (path.filename().string() + suffix);
}

void write_and_rename(const fs::path& path, std::string_view bytes) {
    constexpr int kAttempts = 100;
    for (int attempt = 0;; ++attempt) {
        const fs::path temporary = temporary_beside(path, attempt);
        FileDescriptor file(
            ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode_t{0666}));
        if (!file.valid() && errno == EEXIST && attempt < kAttempts) continue;
        if (!file.valid()) fail(errno);
        try {
            write(file, bytes);
            close(file);
            if (::rename(temporary.c_str(), path.c_str()) != 0) fail(errno);
        } catch (const WriteFailure&) {
            ::unlink(temporary.c_str());
            throw;
        }
        return;
    }
}

}  // namespace

void write_file_atomically(const fs::path& path, std::string_view bytes) {
    std::error_code error;
    fs::path target = path;
    const bool is_link = fs::is_symlink(fs::symlink_status(path, error));
    if (is_link) target = fs::weakly_canonical(path, error);
    if (is_link && error) fail(error.value());
    const fs::file_status status = fs::status(target, error);
    if (fs::is_directory(status)) fail(EISDIR);
    if (fs::exists(status) && ::access(target.c_str(), W_OK) != 0) fail(errno);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        write_directly(target, bytes);
    } else {
        write_and_rename(target, bytes);
    }
}

}  // namespace ellicast::common
