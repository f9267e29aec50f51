// receiver/udp_endpoint.cpp
#include "receiver/udp_endpoint.hpp"

#include <utility>
// asio 1.74 needs <utility> first in C++20.
#include <linux/sock_diag.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <thread>

#include "receiver/group_route.hpp"
#include "receiver/receive_thread.hpp"
#include "receiver/socket_settings.hpp"

namespace ellicast::receiver {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr std::uint16_t kDefaultPort = 5004;     // RFC 3551 section 8
constexpr int kReceiveBuffer = 64 << 20;         // half a second at 1 Gbit/s
constexpr std::size_t kDatagramsPerTurn = 2048;  // then signals and timers get their turn
constexpr Time kTick = std::chrono::milliseconds(100);
constexpr Time kLastTurn = std::chrono::milliseconds(100);

std::string text_of(const udp::endpoint& endpoint) {
    const std::string address = endpoint.address().to_string();
    const std::string port = std::to_string(endpoint.port());
    return (endpoint.address().is_v6() ? "[" + address + "]:" : address + ":") + port;
}

udp::endpoint resolve(asio::io_context& io, const std::string& host, std::uint16_t port) {
    error_code error;
    udp::resolver resolver(io);
    const auto found = resolver.resolve(host, std::to_string(port), udp::resolver::passive, error);
    if (error || found.empty()) {
        throw ListenError("cannot listen on '" + host + "': " + error.message());
    }
    return found.begin()->endpoint();
}

/// Groups of one link mean something only together with an interface.
udp::endpoint on_interface(udp::endpoint endpoint, unsigned interface) {
    if (interface == 0 || !endpoint.address().is_v6()) return endpoint;
    asio::ip::address_v6 address = endpoint.address().to_v6();
    if (address.scope_id() != 0) return endpoint;
    if (address.is_link_local() || address.is_multicast_link_local()) address.scope_id(interface);
    return {address, endpoint.port()};
}

std::string name_of(unsigned interface) {
    std::array<char, IF_NAMESIZE> name{};
    return ::if_indextoname(interface, name.data()) != nullptr ? name.data() : "";
}

/// The interface that the user named, by option or with a group of one link; empty where none.
std::string name_of_interface(const ListenOptions& options, const udp::endpoint& endpoint) {
    if (!options.interface.empty() || !endpoint.address().is_v6()) return options.interface;
    return name_of(static_cast<unsigned>(endpoint.address().to_v6().scope_id()));
}

::sockaddr_storage storage_of(const udp::endpoint& endpoint) {
    ::sockaddr_storage storage{};
    std::memcpy(&storage, endpoint.data(), endpoint.size());
    return storage;
}

}  // namespace

Time UdpEndpoint::now() {
    return std::chrono::steady_clock::now().time_since_epoch();
}

struct UdpEndpoint::Impl {
    asio::io_context io{1};
    udp::socket socket{io};
    asio::signal_set signals{io};
    asio::steady_timer timer{io};
    std::uint32_t drop_counter = 0;  // the kernel's own
    double drops = 0.0;              // datagrams, as far as one can say
    ReceiveThread::Taken taken;      // when we looked last
    Time latest{};                   // handed to the session; its time must not run backwards

    // Where we listen, to find it again.
    udp::endpoint bound;
    std::string interface;  // by name; empty: none in particular
    bool by_route = false;  // the routes chose it, not the user
    unsigned interface_number = 0;
    std::string source;
    bool complained = false;

    // While running.
    bool turn_posted = false;
    ReceiveThread* thread = nullptr;
    Session* session = nullptr;
    std::function<void(Time)> on_tick;
    std::function<void(Time)> on_arrival;

    void open(const ListenOptions& options);
    void join();
    void find_interface(const ListenOptions& options);
    [[nodiscard]] unsigned present_interface() const;
    void follow_interface();
    void post_turn();
    void take_turn();
    void wait_for_tick();
    void wait_for_signal();
    void take(std::size_t most);
    void take_what_has_arrived();
    double datagrams_in_a_piece();
    void count_drops();
    void stop_if_finished();
    Time advance(Time to) { return latest = std::max(latest, to); }
};

void UdpEndpoint::Impl::open(const ListenOptions& options) {
    const std::string& host = options.listen.host;
    const std::uint16_t port = options.listen.port.value_or(kDefaultPort);
    source = options.source;
    interface_number = interface_index(options.interface);
    udp::endpoint endpoint(udp::v6(), port);
    if (!host.empty()) endpoint = on_interface(resolve(io, host, port), interface_number);
    const bool group = endpoint.address().is_multicast();
    if (!options.source.empty() && !group) {
        throw ListenError("--source " + options.source + ": only of a multicast group");
    }
    error_code error;
    socket.open(endpoint.protocol(), error);
    if (error && host.empty()) {  // a host without IPv6
        endpoint = {udp::v4(), port};
        socket.open(endpoint.protocol(), error);
    }
    if (!error && host.empty() && endpoint.protocol() == udp::v6()) {
        socket.set_option(asio::ip::v6_only(false), error);
    }
    if (!error && group) share_port(socket.native_handle());
    if (!error && !group && interface_number != 0) {
        bind_to_interface(socket.native_handle(), options.interface);
    }
    if (!error) socket.bind(endpoint, error);
    if (error) {
        throw ListenError("cannot listen on " + text_of(endpoint) + ": " + error.message());
    }
    bound = endpoint;
    find_interface(options);
    if (group) join();
    socket.non_blocking(true);
    set_reception(socket.native_handle(), kReceiveBuffer);
}

/// A group that is joined where the routes lead is joined there by name all the same, for a
/// membership goes with its interface.
void UdpEndpoint::Impl::find_interface(const ListenOptions& options) {
    interface = name_of_interface(options, bound);
    by_route = interface.empty() && bound.address().is_multicast();
    if (by_route) interface = name_of(interface_of_route(storage_of(bound)));
    interface_number = interface_index(interface);
}

void UdpEndpoint::Impl::join() {
    const ::sockaddr_storage group = storage_of(bound);
    if (source.empty()) {
        return join_group(socket.native_handle(), group, interface_number, nullptr);
    }
    const udp::endpoint sender = resolve(io, source, 0);
    if (sender.protocol() != bound.protocol()) {
        throw ListenError("--source " + source + ": is not of the same family as the group");
    }
    const ::sockaddr_storage from = storage_of(sender);
    join_group(socket.native_handle(), group, interface_number, &from);
}

/// Where to listen now: our interface, or, while it is away and the user named none, where the
/// routes lead instead. 0 for nowhere.
unsigned UdpEndpoint::Impl::present_interface() const {
    const unsigned number = interface.empty() ? 0 : ::if_nametoindex(interface.c_str());
    return number == 0 && by_route ? interface_of_route(storage_of(bound)) : number;
}

/// An interface that goes down and comes up keeps its memberships. One that was away, unplugged or
/// with its driver, is another one to the kernel when it returns, and this socket deaf to it.
void UdpEndpoint::Impl::follow_interface() {
    const unsigned number = present_interface();
    if (number == 0 || number == interface_number) return;
    const int native = socket.native_handle();
    try {
        if (is_bound_to_interface(native)) bind_to_interface(native, interface);
        if (bound.address().is_multicast()) {
            leave_group(native, storage_of(bound), interface_number);
            interface_number = number;
            join();
        }
        interface_number = number;
        complained = false;
        const std::string there = name_of(number);
        const bool back = there == interface;
        spdlog::info("{} {}: listening there{}", there, back ? "is back" : "has the route now",
                     back ? " again" : "");
    } catch (const ListenError& error) {
        interface_number = 0;  // tried again
        if (!complained) spdlog::warn("{} is there, but: {}", name_of(number), error.what());
        complained = true;
    }
}

void UdpEndpoint::Impl::take(std::size_t most) {
    thread->take(most, [this](const Arrival& arrival) {
        session->on_datagram(advance(arrival.time), arrival.source, arrival.bytes);
        return !session->finished();
    });
}

void UdpEndpoint::Impl::stop_if_finished() {
    if (session->finished()) io.stop();
}

/// At most one turn is on its way, however many ask for it.
void UdpEndpoint::Impl::post_turn() {
    if (turn_posted) return;
    turn_posted = true;
    asio::post(io, [this] {
        turn_posted = false;
        take_turn();
    });
}

void UdpEndpoint::Impl::take_turn() {
    take(kDatagramsPerTurn);
    const bool more = session->work();
    if (on_arrival) on_arrival(latest);
    stop_if_finished();
    if (session->finished()) return;
    // What came in the meantime first, that the session can choose.
    if (thread->unsettled() || more) post_turn();
}

void UdpEndpoint::Impl::wait_for_tick() {
    timer.expires_after(kTick);
    timer.async_wait([this](const error_code& error) {
        if (error) return;
        // Silence is only what remains when everything that waits was taken: we may have slept, not
        // they.
        const Time now = UdpEndpoint::now();
        count_drops();
        follow_interface();
        take(kDatagramsPerTurn);
        session->poll(thread->caught_up() ? advance(now) : latest);
        if (on_arrival) on_arrival(latest);
        on_tick(latest);
        stop_if_finished();
        wait_for_tick();
    });
}

void UdpEndpoint::Impl::wait_for_signal() {
    signals.async_wait([this](const error_code& error, int) {
        if (error) return;
        take_what_has_arrived();
        session->interrupt(advance(UdpEndpoint::now()));
        stop_if_finished();
    });
}

// Before an interrupt: it was received. Of a stream without gaps there is always more.
void UdpEndpoint::Impl::take_what_has_arrived() {
    const Time until = UdpEndpoint::now() + kLastTurn;
    while (!session->finished() && !thread->caught_up() && UdpEndpoint::now() < until) {
        take(kDatagramsPerTurn);
        std::this_thread::yield();
    }
    while (session->work() && UdpEndpoint::now() < until) {
    }
}

// On average since the last look; 1 unless the receiving thread was behind.
double UdpEndpoint::Impl::datagrams_in_a_piece() {
    const ReceiveThread::Taken now = thread != nullptr ? thread->taken() : taken;
    const std::uint64_t pieces = now.pieces - taken.pieces;
    const std::uint64_t datagrams = now.datagrams - taken.datagrams;
    taken = now;
    return pieces == 0 ? 1.0 : static_cast<double>(datagrams) / static_cast<double>(pieces);
}

// The kernel counts modulo 2^32, and what it would have handed over in one piece as one.
void UdpEndpoint::Impl::count_drops() {
    std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
    socklen_t size = sizeof(info);
    if (getsockopt(socket.native_handle(), SOL_SOCKET, SO_MEMINFO, info.data(), &size) == 0 &&
        size > SK_MEMINFO_DROPS * sizeof(std::uint32_t)) {
        const std::uint32_t pieces = info[SK_MEMINFO_DROPS] - drop_counter;
        drop_counter = info[SK_MEMINFO_DROPS];
        drops += pieces * datagrams_in_a_piece();
    }
}

UdpEndpoint::UdpEndpoint(const ListenOptions& options) : impl_(std::make_unique<Impl>()) {
    impl_->open(options);
    impl_->signals.add(SIGINT);
    impl_->signals.add(SIGTERM);
}

UdpEndpoint::~UdpEndpoint() = default;

void UdpEndpoint::run(Session& session, const std::function<void(Time)>& on_tick,
                      const std::function<void(Time)>& on_arrival) {
    Impl& impl = *impl_;
    impl.session = &session;
    impl.on_tick = on_tick;
    impl.on_arrival = on_arrival;
    impl.taken = {};
    {
        ReceiveThread thread(impl.socket.native_handle(),
                             [&impl] { asio::post(impl.io, [&impl] { impl.post_turn(); }); });
        impl.thread = &thread;
        impl.wait_for_signal();
        impl.wait_for_tick();
        impl.io.run();
        impl.count_drops();
    }
    impl.thread = nullptr;
}

std::string UdpEndpoint::address() const {
    error_code error;
    const udp::endpoint endpoint = impl_->socket.local_endpoint(error);
    return error ? "?" : text_of(endpoint);
}

std::size_t UdpEndpoint::receive_buffer() const {
    int size = 0;
    socklen_t length = sizeof(size);
    getsockopt(impl_->socket.native_handle(), SOL_SOCKET, SO_RCVBUF, &size, &length);
    return static_cast<std::size_t>(std::max(size, 0));
}

std::uint64_t UdpEndpoint::kernel_dropped() const {
    return static_cast<std::uint64_t>(std::llround(impl_->drops));
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

}  // namespace ellicast::receiver
