// sender/udp_endpoint.cpp
#include "sender/udp_endpoint.hpp"

#include <net/if.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <span>
#include <system_error>
#include <thread>
#include <utility>  // before Asio, which forgets it in C++20

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include "sender/batch_sending.hpp"
#include "sender/packing_ahead.hpp"
#include "sender/socket_settings.hpp"

namespace ellicast::sender {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

// Room for the burst of a fast stream; the system may grant less. The kernel counts twice as much,
// and 2304 bytes for a datagram of 1200: some 900 datagrams, 9 ms at 1 Gbit/s, and less than the
// 1000 places of an interface's default queue.
constexpr int kSendBufferBytes = 1 << 20;

// An interface that takes nothing for longer than this is not busy.
constexpr Time kLongestQueue = std::chrono::seconds(1);

// Shortest sleep. Finer than any pace that one sees, coarse enough that a gigabit stream leaves in
// batches of twenty instead of one wake-up a datagram.
constexpr Time kLeastSleep = std::chrono::microseconds(200);

constexpr Time kTick = std::chrono::milliseconds(200);

std::string to_text(const udp::endpoint& endpoint) {
    const std::string address = endpoint.address().to_string();
    const std::string port = ":" + std::to_string(endpoint.port());
    return endpoint.address().is_v6() ? "[" + address + "]" + port : address + port;
}

/// Without the zone, which means something on this host alone.
std::string address_text(const asio::ip::address& address) {
    if (!address.is_v6()) return address.to_string();
    asio::ip::address_v6 v6 = address.to_v6();
    v6.scope_id(0);
    return v6.to_string();
}

/// Addresses of one link mean something only together with an interface.
udp::endpoint on_interface(udp::endpoint endpoint, unsigned interface) {
    if (interface == 0 || !endpoint.address().is_v6()) return endpoint;
    asio::ip::address_v6 address = endpoint.address().to_v6();
    if (address.scope_id() != 0) return endpoint;
    if (address.is_link_local() || address.is_multicast_link_local()) address.scope_id(interface);
    return {address, endpoint.port()};
}

/// The interface that the user named, by option or with an address of one link; empty where none.
std::string name_of_interface(const SocketOptions& options, const udp::endpoint& endpoint) {
    if (!options.interface.empty() || !endpoint.address().is_v6()) return options.interface;
    std::array<char, IF_NAMESIZE> name{};
    const auto scope = static_cast<unsigned>(endpoint.address().to_v6().scope_id());
    return ::if_indextoname(scope, name.data()) != nullptr ? name.data() : "";
}

/// The same address by the interface that has this number now.
udp::endpoint renumbered(const udp::endpoint& endpoint, unsigned interface) {
    if (!endpoint.address().is_v6()) return endpoint;
    asio::ip::address_v6 address = endpoint.address().to_v6();
    if (address.scope_id() != 0) address.scope_id(interface);
    return {address, endpoint.port()};
}

/// What may be an ICMP answer to an earlier datagram, told in place of sending this one. Telling it
/// clears it.
bool may_be_answer(int error) {
    return error == ECONNREFUSED || error == EHOSTUNREACH || error == ENETUNREACH ||
           error == EACCES || error == EPROTO || error == EHOSTDOWN || error == ENONET ||
           error == EOPNOTSUPP || error == ENOPROTOOPT;
}

std::string reason_of(const error_code& error) {
    if (error == boost::system::errc::permission_denied) {
        return error.message() + "; if it is a broadcast address, ask for --broadcast";
    }
    if (error == boost::system::errc::invalid_argument ||
        error == boost::system::errc::network_unreachable) {
        return error.message() + "; perhaps --interface helps";
    }
    return error.message();
}

}  // namespace

struct UdpEndpoint::Impl {
    explicit Impl(const SocketOptions& socket_options)
        : options(socket_options), sending(options.segments) {}

    SocketOptions options;
    std::string interface;  // by name; empty: none in particular
    unsigned interface_number = 0;
    std::uint16_t local_port = 0;  // 0: any
    bool complained = false;

    asio::io_context context{1};
    udp::socket socket{context};
    asio::steady_timer timer{context};
    udp::endpoint peer;
    EndpointCounts counts;

    // While running.
    Session* session = nullptr;
    const RunHooks* hooks = nullptr;
    asio::steady_timer stop_timer{context};
    asio::steady_timer tick_timer{context};
    asio::signal_set signals{context};
    PackingAhead* ahead = nullptr;  // where the session is not paced
    std::vector<Datagram> batch;
    bool last_batch = false;
    BatchSending sending;
    std::size_t batch_sent = 0;  // how much of the batch is done with
    int answers_in_a_row = 0;
    std::optional<Time> queue_full_since;  // nothing has been taken since then
    bool stopping = false;                 // at the end of the round
    bool interrupted = false;

    void open(const std::string& host, std::uint16_t port);
    [[nodiscard]] error_code connect();
    void follow_interface();
    void check_size(std::size_t datagram_bytes) const;
    [[nodiscard]] bool v6() const { return peer.address().is_v6(); }
    [[nodiscard]] std::size_t ip_udp_bytes() const { return v6() ? 48 : 28; }
    [[nodiscard]] std::optional<std::size_t> mtu() const;

    enum class Room { enough, socket_full, queue_full };
    void step();
    void next_batch();
    void settle();
    void sleep_until(Time when);
    Room send_batch();
    Room go_on_after(const BatchSending::Progress& progress);
    void wait_for_tick();
    void wait_for_signal();
    void on_signal(int number);
    void interrupt();
};

void UdpEndpoint::Impl::open(const std::string& host, std::uint16_t port) {
    udp::resolver resolver(context);
    error_code error;
    const auto found =
        resolver.resolve(host, std::to_string(port), udp::resolver::numeric_service, error);
    if (error) throw SendError("cannot resolve host '" + host + "': " + error.message());
    for (const auto& entry : found) {
        peer = on_interface(entry.endpoint(), interface_index(options));
        error = connect();
        if (!error) break;
    }
    if (error) throw SendError("cannot send to " + to_text(peer) + ": " + reason_of(error));
    interface = name_of_interface(options, peer);
    interface_number = ::if_nametoindex(interface.c_str());
    local_port = socket.local_endpoint(error).port();
}

/// A new socket to the peer, from the same port as the last one.
error_code UdpEndpoint::Impl::connect() {
    error_code error;
    socket.close(error);
    socket.open(peer.protocol(), error);
    if (error) return error;
    const int native = socket.native_handle();
    set_addressing(native, v6(), peer.address().is_multicast(), options);
    forbid_fragments(native, v6());
    hear_of_full_queues(native, v6());
    if (local_port != 0) socket.bind({peer.protocol(), local_port}, error);
    if (!error) socket.connect(peer, error);
    if (error) return error;
    socket.native_non_blocking(true);
    // The system may grant less.
    (void)::setsockopt(native, SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
    return {};
}

/// An interface that goes down and comes up is the same to the socket. One that was away,
/// unplugged or with its driver, is another one to the kernel when it returns: a new socket sends
/// there, from the same port, for receivers go by it.
void UdpEndpoint::Impl::follow_interface() {
    const unsigned number = interface.empty() ? 0 : ::if_nametoindex(interface.c_str());
    if (number == 0 || number == interface_number) return;
    if (!has_address(interface, v6())) return;  // the kernel would lend another one's for good
    std::string complaint;
    try {
        peer = renumbered(peer, number);
        const error_code error = connect();
        if (error) complaint = reason_of(error);
    } catch (const SendError& failure) {
        complaint = failure.what();
    }
    if (complaint.empty()) {
        interface_number = number;
        spdlog::info("{} is back: sending there again", interface);
    } else if (!complained) {
        spdlog::warn("{} is back, but: {}", interface, complaint);  // tried again at every tick
    }
    complained = !complaint.empty();
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
    if (batch_sent == batch.size()) next_batch();
    const Room room = send_batch();
    const Time after = now();
    if (room != Room::enough) ++counts.socket_full;
    if (room == Room::queue_full) {
        sleep_until(after + kLeastSleep);  // nobody tells when there is room again
    } else if (room == Room::socket_full) {
        forget_answers(socket.native_handle());
        socket.async_wait(udp::socket::wait_write, [this](const error_code& error) {
            // Cut short by a new socket, which may have room.
            if (!error || error == asio::error::operation_aborted) step();
        });
    } else if (last_batch) {
        // Not by cancelling what else is waited for: a tick that is due would go on.
        context.stop();
    } else if (ahead || session->next_wakeup() <= after) {
        asio::post(context, [this] { step(); });  // by way of the loop, so that signals are heard
    } else {
        sleep_until(std::max(session->next_wakeup(), after + kLeastSleep));
    }
}

void UdpEndpoint::Impl::next_batch() {
    batch_sent = 0;
    if (ahead) {
        PackingAhead::Batch made = ahead->take(now(), std::move(batch));
        batch = std::move(made.datagrams);
        last_batch = made.last;
        return;
    }
    session->recycle(batch);
    session->poll(now(), batch);
    last_batch = session->done();
}

/// Before anybody looks at the session or changes it.
void UdpEndpoint::Impl::settle() {
    if (ahead) ahead->settle();
}

void UdpEndpoint::Impl::sleep_until(Time when) {
    timer.expires_at(std::chrono::steady_clock::time_point(
        std::chrono::duration_cast<std::chrono::steady_clock::duration>(when)));
    timer.async_wait([this](const error_code& error) {
        if (!error) step();
    });
}

/// Until all is sent or there is no room for the rest.
UdpEndpoint::Impl::Room UdpEndpoint::Impl::send_batch() {
    while (batch_sent < batch.size()) {
        const BatchSending::Progress progress =
            sending.send(socket.native_handle(), std::span(batch).subspan(batch_sent));
        if (progress.datagrams > 0) {
            answers_in_a_row = 0;
            queue_full_since.reset();
        }
        counts.bytes += progress.bytes;
        counts.sent += progress.datagrams;
        batch_sent += progress.datagrams;
        const Room room = progress.error == 0 ? Room::enough : go_on_after(progress);
        if (room != Room::enough) return room;
    }
    return Room::enough;
}

/// Deals with the error that the next datagrams of the batch met.
UdpEndpoint::Impl::Room UdpEndpoint::Impl::go_on_after(const BatchSending::Progress& progress) {
    const int error = progress.error;
    if (error == EAGAIN || error == EWOULDBLOCK) return Room::socket_full;
    if (error == ENOBUFS) {
        if (!queue_full_since) queue_full_since = now();
        if (now() - *queue_full_since < kLongestQueue) return Room::queue_full;
        // No queue is full for so long; a filter drops them.
    }
    if (error == EINTR) return Room::enough;
    if (may_be_answer(error) && answers_in_a_row < 3) {
        ++answers_in_a_row;
        if (error == ECONNREFUSED) ++counts.unreachable;
        return Room::enough;
    }
    answers_in_a_row = 0;
    counts.refused += progress.refused;
    counts.last_refusal = std::generic_category().message(error);
    if (error == EMSGSIZE && mtu()) {
        counts.last_refusal += "; by now the way carries " + std::to_string(*mtu()) +
                               " bytes a packet: use --datagram " +
                               std::to_string(*mtu() - ip_udp_bytes()) + " or less";
    }
    batch_sent += progress.refused;
    return Room::enough;
}

UdpEndpoint::UdpEndpoint(const std::string& host, std::uint16_t port, std::size_t datagram_bytes,
                         const SocketOptions& options)
    : impl_(std::make_unique<Impl>(options)) {
    impl_->open(host, port);
    impl_->check_size(datagram_bytes);
}

UdpEndpoint::~UdpEndpoint() = default;

/// By a timer of its own: what waits for the socket or for a slow pace has ticks, too.
void UdpEndpoint::Impl::wait_for_tick() {
    tick_timer.expires_after(kTick);
    tick_timer.async_wait([this](const error_code& error) {
        if (error || interrupted) return;
        follow_interface();
        settle();
        if (!hooks->on_tick || hooks->on_tick()) {
            wait_for_tick();
        } else {
            interrupt();
        }
    });
}

void UdpEndpoint::Impl::wait_for_signal() {
    signals.async_wait([this](const error_code& error, int number) {
        if (!error) on_signal(number);
    });
}

void UdpEndpoint::Impl::on_signal(int number) {
    const bool first = !stopping;
    settle();
    if (number == SIGHUP) {
        hooks->on_hangup();
    } else if (number == SIGTERM && first && hooks->stop_within > Time::zero()) {
        stopping = true;
        session->finish_round();
        stop_timer.expires_after(hooks->stop_within);
        stop_timer.async_wait([this](const error_code& error) {
            if (!error) interrupt();
        });
    } else {
        interrupt();
        return;
    }
    wait_for_signal();
}

void UdpEndpoint::Impl::interrupt() {
    interrupted = true;
    context.stop();
}

bool UdpEndpoint::run(Session& session, const RunHooks& hooks) {
    Impl& impl = *impl_;
    impl.session = &session;
    impl.hooks = &hooks;
    impl.stopping = false;
    impl.interrupted = false;
    impl.batch.clear();
    impl.batch_sent = 0;
    impl.last_batch = false;
    std::optional<PackingAhead> ahead;
    if (session.unpaced() && std::thread::hardware_concurrency() > 1) ahead.emplace(session);
    impl.ahead = ahead ? &*ahead : nullptr;
    impl.signals.add(SIGINT);
    impl.signals.add(SIGTERM);
    if (hooks.on_hangup) impl.signals.add(SIGHUP);
    impl.wait_for_signal();
    impl.wait_for_tick();
    asio::post(impl.context, [&impl] { impl.step(); });
    impl.context.restart();
    impl.context.run();
    impl.settle();
    impl.signals.clear();
    return !impl.interrupted && !session.cut_short();
}

std::string UdpEndpoint::peer() const {
    return to_text(impl_->peer);
}
std::string UdpEndpoint::peer_address() const {
    return address_text(impl_->peer.address());
}
std::string UdpEndpoint::local_address() const {
    error_code error;
    const udp::endpoint local = impl_->socket.local_endpoint(error);
    return error || local.address().is_unspecified() ? "" : address_text(local.address());
}
std::optional<Link> UdpEndpoint::link() const {
    return link_of(impl_->socket.native_handle(), impl_->interface);
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

void UdpEndpoint::tell_local(const std::string& socket, std::string_view lines) {
    sockaddr_un address{};
    if (socket.empty() || socket.size() >= sizeof address.sun_path) return;
    address.sun_family = AF_UNIX;
    std::copy(socket.begin(), socket.end(), address.sun_path);
    if (socket[0] == '@') address.sun_path[0] = '\0';  // Linux's abstract namespace
    const int descriptor = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (descriptor < 0) return;
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket.size());
    (void)::sendto(descriptor, lines.data(), lines.size(), MSG_NOSIGNAL,
                   reinterpret_cast<const sockaddr*>(&address), length);
    ::close(descriptor);
}

}  // namespace ellicast::sender
