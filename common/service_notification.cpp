// common/service_notification.cpp
#include "common/service_notification.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace ellicast::common {
namespace {

std::string taken_from_environment(const char* name) {
    const char* const value = std::getenv(name);
    std::string text = value ? value : "";
    unsetenv(name);
    return text;
}

std::optional<std::chrono::microseconds> half_of(const std::string& microseconds) {
    std::int64_t value = 0;
    const char* const end = microseconds.data() + microseconds.size();
    const auto [rest, error] = std::from_chars(microseconds.data(), end, value);
    if (error != std::errc() || rest != end || value < 2) return std::nullopt;
    return std::chrono::microseconds(value / 2);
}

}  // namespace

std::string status_line(std::string_view text) {
    std::string line(text);
    std::replace_if(
        line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
    return line;
}

ServiceNotification::ServiceNotification(Send send)
    : send_(std::move(send)),
      socket_(taken_from_environment("NOTIFY_SOCKET")),
      watchdog_interval_(half_of(taken_from_environment("WATCHDOG_USEC"))) {
    const bool absolute = !socket_.empty() && (socket_[0] == '/' || socket_[0] == '@');
    if (!absolute || socket_.size() > kLongestName) socket_.clear();
    if (socket_.empty()) watchdog_interval_.reset();
}

void ServiceNotification::say(const std::string& lines) const {
    if (wanted()) send_(socket_, lines);
}

void ServiceNotification::ready(std::string_view status) const {
    say("READY=1\nSTATUS=" + status_line(status));
}
void ServiceNotification::status(std::string_view status) const {
    say("STATUS=" + status_line(status));
}
void ServiceNotification::stopping() const {
    say("STOPPING=1");
}
void ServiceNotification::alive() const {
    say("WATCHDOG=1");
}
void ServiceNotification::alive_when_due(std::chrono::nanoseconds now) {
    if (!watchdog_interval_ || now < next_alive_) return;
    next_alive_ = now + *watchdog_interval_ / 2;
    alive();
}

}  // namespace ellicast::common
