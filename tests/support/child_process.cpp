// tests/support/child_process.cpp
#include "tests/support/child_process.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <thread>

namespace ellicast::tests {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPollInterval = std::chrono::milliseconds(5);

void redirect(const std::filesystem::path& path, int descriptor) {
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (file < 0 || dup2(file, descriptor) < 0) _exit(126);
}

}  // namespace

TemporaryDirectory::TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "ellicast-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary directory");
    path_ = pattern;
}

TemporaryDirectory::~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

ChildProcess::ChildProcess(const std::filesystem::path& program,
                           const std::vector<std::string>& arguments) {
    std::vector<std::string> words{program.string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const auto out = directory_.path() / "out";
    const auto err = directory_.path() / "err";

    pid_ = fork();
    if (pid_ < 0) throw std::runtime_error("cannot fork");
    if (pid_ == 0) {
        redirect("/dev/null", STDIN_FILENO);
        redirect(out, STDOUT_FILENO);
        redirect(err, STDERR_FILENO);
        execv(argv[0], argv.data());
        _exit(127);
    }
}

ChildProcess::~ChildProcess() {
    if (ended_) return;
    send_signal(SIGKILL);
    reap(true);
}

void ChildProcess::send_signal(int number) const {
    if (!ended_) kill(pid_, number);
}

bool ChildProcess::reap(bool block) {
    if (ended_) return true;
    int status = 0;
    if (waitpid(pid_, &status, block ? 0 : WNOHANG) != pid_) return false;
    ended_ = true;
    code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return true;
}

int ChildProcess::wait(std::chrono::seconds limit) {
    const auto deadline = Clock::now() + limit;
    while (!reap(false)) {
        if (Clock::now() > deadline) {
            send_signal(SIGKILL);
            reap(true);
            throw std::runtime_error("the program did not end in time; stderr: " + err());
        }
        std::this_thread::sleep_for(kPollInterval);
    }
    return code_;
}

std::string ChildProcess::out() const {
    return read_file(directory_.path() / "out");
}
std::string ChildProcess::err() const {
    return read_file(directory_.path() / "err");
}

bool ChildProcess::await_err(const std::string& text) {
    const auto deadline = Clock::now() + std::chrono::seconds(20);
    while (true) {
        const bool ended = reap(false);
        if (err().find(text) != std::string::npos) return true;
        if (ended || Clock::now() > deadline) return false;
        std::this_thread::sleep_for(kPollInterval);
    }
}

std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool eventually(const std::function<bool()>& is_so, std::chrono::seconds limit) {
    const auto deadline = Clock::now() + limit;
    while (!is_so()) {
        if (Clock::now() > deadline) return false;
        std::this_thread::sleep_for(kPollInterval);
    }
    return true;
}

std::uint16_t free_port() {
    const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof(address);
    const bool bound = ::bind(socket, reinterpret_cast<sockaddr*>(&address), length) == 0 &&
                       ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length) == 0;
    ::close(socket);
    if (!bound) throw std::runtime_error("no free UDP port");
    return ntohs(address.sin_port);
}

}  // namespace ellicast::tests
