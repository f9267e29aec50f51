// tests/support/child_process.hpp: real programs, run and watched by tests.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace ellicast::tests {

/// A fresh directory that goes with the object.
class TemporaryDirectory {
  public:
    TemporaryDirectory();
    ~TemporaryDirectory();
    TemporaryDirectory(const TemporaryDirectory&) = delete;
    TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

/// A running program with captured output; killed with the object when it still runs.
class ChildProcess {
  public:
    /// Starts it; throws std::runtime_error when that fails.
    ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments);
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    [[nodiscard]] pid_t pid() const { return pid_; }
    void send_signal(int number) const;

    /// Exit code, or 128 + signal that ended it. Throws std::runtime_error, and kills it, when it
    /// still runs after `limit`.
    int wait(std::chrono::seconds limit = std::chrono::seconds(300));

    /// Text so far.
    [[nodiscard]] std::string out() const;
    [[nodiscard]] std::string err() const;

    /// Waits until `text` stands on stderr; false when the program ended or 20 s passed without it.
    bool await_err(const std::string& text);

  private:
    bool reap(bool block);

    TemporaryDirectory directory_;
    pid_t pid_ = -1;
    bool ended_ = false;
    int code_ = 0;
};

/// Whether `is_so` came true before `limit` was over. It is asked fifty times a second: how fast
/// the machine is says nothing but how long this takes.
bool eventually(const std::function<bool()>& is_so,
                std::chrono::seconds limit = std::chrono::seconds(60));

/// A UDP port of the loopback interface that nobody has at this moment, for programs that must
/// agree on one beforehand. Throws std::runtime_error where there is none.
std::uint16_t free_port();

std::string read_file(const std::filesystem::path& path);

}  // namespace ellicast::tests
