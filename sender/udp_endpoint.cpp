// sender/udp_endpoint.cpp
#include "sender/udp_endpoint.hpp"

#include <netinet/in.h>
#include <netinet/ip.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>
#include <utility>  // before Asio, which forgets it in C++20

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

namespace ellicast::sender {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

// Room for the burst of a fast stream; the system may grant less.
constexpr int kSendBufferBytes = 4 << 20;

// Shortest sleep. Finer than any pace that one sees, coarse enough that a gigabit stream leaves in
// batches of twenty instead of one wake-up a datagram.
constexpr Time kLeastSleep = std::chrono::microseconds(200);

constexpr Time kTick = std::chrono::milliseconds(200);

void set_option(int socket, int level, int name, int value) {
    // Refusals are no error: without the option the datagrams go all the same.
    (void)::setsockopt(socket, level, name, &value, sizeof value);
}

void forbid_fragments(udp::socket& socket, bool v6) {
    const int native = socket.native_handle();
    set_option(native, IPPROTO_IP, IP_MTU_DISCOVER, IP_PMTUDISC_DO);
    if (!v6) return;
    set_option(native, IPPROTO_IPV6, IPV6_MTU_DISCOVER, IPV6_PMTUDISC_DO);
    set_option(native, IPPROTO_IPV6, IPV6_DONTFRAG, 1);
}

std::string to_text(const udp::endpoint& endpoint) {
    const std::string address = endpoint.address().to_string();
    const std::string port = ":" + std::to_string(endpoint.port());
    return endpoint.address().is_v6() ? "[" + address + "]" + port : address + port;
}

}  // namespace

struct UdpEndpoint::Impl {
    asio::io_context context{1};
    udp::socket socket{context};
    asio::steady_timer timer{context};
    udp::endpoint peer;
    EndpointCounts counts;

    // While running.
    Session* session = nullptr;
    const std::function<void()>* on_tick = nullptr;
    asio::signal_set signals{context};
    std::vector<Datagram> batch;
    std::size_t batch_sent = 0;  // how much of the batch is done with
    int unreachable_in_a_row = 0;
    Time next_tick{};
    bool interrupted = false;

    void open(const std::string& host, std::uint16_t port);
    void check_size(std::size_t datagram_bytes) const;
    [[nodiscard]] bool v6() const { return peer.address().is_v6(); }
    [[nodiscard]] std::size_t ip_udp_bytes() const { return v6() ? 48 : 28; }
    [[nodiscard]] std::optional<std::size_t> mtu() const;

    void step();
    void sleep_until(Time when);
    bool send_batch();
    bool go_on_after(int error);
};

void UdpEndpoint::Impl::open(const std::string& host, std::uint16_t port) {
    udp::resolver resolver(context);
    error_code error;
    const auto found =
        resolver.resolve(host, std::to_string(port), udp::resolver::numeric_service, error);
    if (error) throw SendError("cannot resolve host '" + host + "': " + error.message());
    for (const auto& entry : found) {
        peer = entry.endpoint();
        socket.close(error);
        socket.open(peer.protocol(), error);
        if (!error) socket.connect(peer, error);
        if (!error) break;
    }
    if (error) throw SendError("cannot send to " + to_text(peer) + ": " + error.message());
    socket.native_non_blocking(true);
    forbid_fragments(socket, v6());
    set_option(socket.native_handle(), SOL_SOCKET, SO_SNDBUF, kSendBufferBytes);
}

std::optional<std::size_t> UdpEndpoint::Impl::mtu() const {
    int bytes = 0;
    socklen_t length = sizeof bytes;
    auto& handle = const_cast<udp::socket&>(socket);  // Asio's native_handle is not const
    const int level = v6() ? IPPROTO_IPV6 : IPPROTO_IP;
    const int name = v6() ? IPV6_MTU : IP_MTU;
    if (::getsockopt(handle.native_handle(), level, name, &bytes, &length) != 0 || bytes <= 0) {
        return std::nullopt;
    }
    return static_cast<std::size_t>(bytes);
}

void UdpEndpoint::Impl::check_size(std::size_t datagram_bytes) const {
    const std::optional<std::size_t> carried = mtu();
    const std::size_t packet = datagram_bytes + ip_udp_bytes();
    if (!carried || packet <= *carried) return;
    throw SendError("datagrams of " + std::to_string(datagram_bytes) + " bytes are packets of " +
                    std::to_string(packet) + " bytes, and the way to " + to_text(peer) +
                    " carries " + std::to_string(*carried) + ": use --datagram " +
                    std::to_string(*carried - ip_udp_bytes()) + " or less");
}

/// Sends what is due and arranges for the next step: when the socket has room, the next datagram is
/// due, or at once.
void UdpEndpoint::Impl::step() {
    if (interrupted) return;
    if (batch_sent == batch.size()) {
        batch.clear();
        batch_sent = 0;
        session->poll(now(), batch);
    }
    const bool all_sent = send_batch();
    const Time after = now();
    if (after >= next_tick) {
        next_tick = after + kTick;
        if (*on_tick) (*on_tick)();
    }
    if (!all_sent) {
        ++counts.socket_full;
        socket.async_wait(udp::socket::wait_write, [this](const error_code& error) {
            if (!error) step();
        });
    } else if (session->done()) {
        signals.cancel();
    } else if (session->next_wakeup() <= after) {
        asio::post(context, [this] { step(); });  // by way of the loop, so that signals are heard
    } else {
        sleep_until(std::max(session->next_wakeup(), after + kLeastSleep));
    }
}

void UdpEndpoint::Impl::sleep_until(Time when) {
    timer.expires_at(std::chrono::steady_clock::time_point(
        std::chrono::duration_cast<std::chrono::steady_clock::duration>(when)));
    timer.async_wait([this](const error_code& error) {
        if (!error) step();
    });
}

/// False when the socket has no room for the rest.
bool UdpEndpoint::Impl::send_batch() {
    while (batch_sent < batch.size()) {
        std::array<::iovec, 2 * Session::kBatch> pieces{};
        std::array<::mmsghdr, 2 * Session::kBatch> messages{};
        const std::size_t count = std::min(pieces.size(), batch.size() - batch_sent);
        for (std::size_t k = 0; k < count; ++k) {
            Datagram& datagram = batch[batch_sent + k];
            pieces[k] = {datagram.data(), datagram.size()};
            messages[k].msg_hdr.msg_iov = &pieces[k];
            messages[k].msg_hdr.msg_iovlen = 1;
        }
        const int taken = ::sendmmsg(socket.native_handle(), messages.data(),
                                     static_cast<unsigned>(count), MSG_NOSIGNAL);
        if (taken <= 0) {
            if (!go_on_after(errno)) return false;
            continue;
        }
        unreachable_in_a_row = 0;
        for (std::size_t k = 0; k < static_cast<std::size_t>(taken); ++k) {
            counts.bytes += batch[batch_sent + k].size();
        }
        counts.sent += static_cast<std::size_t>(taken);
        batch_sent += static_cast<std::size_t>(taken);
    }
    return true;
}

/// Deals with the error that the next datagram of the batch met. False: wait for room.
bool UdpEndpoint::Impl::go_on_after(int error) {
    if (error == EAGAIN || error == EWOULDBLOCK) return false;
    if (error == EINTR) return true;
    // An ICMP answer to an earlier datagram, told in place of sending this one; telling it clears
    // it.
    if (error == ECONNREFUSED && unreachable_in_a_row < 3) {
        ++unreachable_in_a_row;
        ++counts.unreachable;
        return true;
    }
    unreachable_in_a_row = 0;
    ++counts.refused;
    counts.last_refusal = std::generic_category().message(error);
    ++batch_sent;
    return true;
}

UdpEndpoint::UdpEndpoint(const std::string& host, std::uint16_t port, std::size_t datagram_bytes)
    : impl_(std::make_unique<Impl>()) {
    impl_->open(host, port);
    impl_->check_size(datagram_bytes);
}

UdpEndpoint::~UdpEndpoint() = default;

bool UdpEndpoint::run(Session& session, const std::function<void()>& on_tick) {
    Impl& impl = *impl_;
    impl.session = &session;
    impl.on_tick = &on_tick;
    impl.interrupted = false;
    impl.next_tick = now() + kTick;
    impl.batch.clear();
    impl.batch_sent = 0;
    impl.signals.add(SIGINT);
    impl.signals.add(SIGTERM);
    impl.signals.async_wait([&impl](const error_code& error, int) {
        if (error) return;
        impl.interrupted = true;
        impl.context.stop();
    });
    asio::post(impl.context, [&impl] { impl.step(); });
    impl.context.restart();
    impl.context.run();
    impl.signals.clear();
    return !impl.interrupted;
}

std::string UdpEndpoint::peer() const {
    return to_text(impl_->peer);
}
std::size_t UdpEndpoint::ip_udp_bytes() const {
    return impl_->ip_udp_bytes();
}
std::optional<std::size_t> UdpEndpoint::mtu() const {
    return impl_->mtu();
}
const EndpointCounts& UdpEndpoint::counts() const {
    return impl_->counts;
}

Time UdpEndpoint::now() {
    return std::chrono::steady_clock::now().time_since_epoch();
}

}  // namespace ellicast::sender
