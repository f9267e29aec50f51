// common/atomic_file.cpp
#include "common/atomic_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace ellicast::common {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(int error) {
    throw WriteFailure(std::generic_category().message(error));
}

// An open file that is closed whatever happens.
class Descriptor {
  public:
    explicit Descriptor(int fd) : fd_(fd) {}
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    [[nodiscard]] bool valid() const { return fd_ >= 0; }

    void write(std::string_view bytes) const {
        while (!bytes.empty()) {
            const ::ssize_t written = ::write(fd_, bytes.data(), bytes.size());
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) fail(errno);
            bytes.remove_prefix(static_cast<std::size_t>(written));
        }
    }

    void close() {  // some file systems report a full disk only here
        const int fd = fd_;
        fd_ = -1;
        if (::close(fd) != 0) fail(errno);
    }

  private:
    int fd_;
};

void write_directly(const fs::path& path, std::string_view bytes) {
    Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!file.valid()) fail(errno);
    file.write(bytes);
    file.close();
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
        Descriptor file(
            ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode_t{0666}));
        if (!file.valid() && errno == EEXIST && attempt < kAttempts) continue;
        if (!file.valid()) fail(errno);
        try {
            file.write(bytes);
            file.close();
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
