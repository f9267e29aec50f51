// common/service_notification.hpp
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace ellicast::common {

/// What a service tells the manager that started it: systemd's datagrams of lines NAME=VALUE to the
/// socket that $NOTIFY_SOCKET names (sd_notify(3); a leading '@' is Linux's abstract namespace).
/// Without that variable nothing happens. Nothing here fails: whoever does not listen is not told.
class ServiceNotification {
  public:
    /// Sends a datagram to the local socket of that name, as the variable has it; at most
    /// kLongestName bytes. The endpoints do it, for nothing else knows sockets.
    using Send = std::function<void(const std::string& socket, std::string_view lines)>;
    static constexpr std::size_t kLongestName = 107;  // what a sockaddr_un holds, with an end

    /// Reads $NOTIFY_SOCKET, and $WATCHDOG_USEC for watchdog_interval(), and takes both out of the
    /// environment, so that children do not speak for us.
    explicit ServiceNotification(Send send);

    [[nodiscard]] bool wanted() const { return !socket_.empty(); }

    /// Readiness, with a line for whoever asks for the status.
    void ready(std::string_view status) const;
    void status(std::string_view status) const;
    void stopping() const;
    void alive() const;
    /// Says it where that is expected and due: twice in every watchdog_interval(). Moments must not
    /// run backwards.
    void alive_when_due(std::chrono::nanoseconds now);

    /// How often alive() must be said at least; empty: not expected. Half of what the manager
    /// tolerates.
    [[nodiscard]] std::optional<std::chrono::microseconds> watchdog_interval() const {
        return watchdog_interval_;
    }

  private:
    void say(const std::string& lines) const;

    Send send_;
    std::string socket_;
    std::optional<std::chrono::microseconds> watchdog_interval_;
    std::chrono::nanoseconds next_alive_{};
};

/// One line without control characters.
std::string status_line(std::string_view text);

}  // namespace ellicast::common
