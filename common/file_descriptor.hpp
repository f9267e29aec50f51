// common/file_descriptor.hpp: private to common/atomic_file and common/key_file.
#pragma once

#include <unistd.h>

#include <utility>

namespace ellicast::common {

/// An open file that is closed whatever happens; or none, with a negative number.
class FileDescriptor {
  public:
    explicit FileDescriptor(int fd) : fd_(fd) {}
    ~FileDescriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    FileDescriptor(const FileDescriptor&) = delete;
    FileDescriptor& operator=(const FileDescriptor&) = delete;

    [[nodiscard]] bool valid() const { return fd_ >= 0; }
    [[nodiscard]] int get() const { return fd_; }
    /// For whoever closes it and asks how that went.
    [[nodiscard]] int release() { return std::exchange(fd_, -1); }

  private:
    int fd_;
};

}  // namespace ellicast::common
