// receiver/udp_endpoint.cpp
#include "receiver/udp_endpoint.hpp"

#include <utility>
// asio 1.74 needs <utility> first in C++20.
#include <linux/sock_diag.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <span>
#include <vector>

namespace ellicast::receiver {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr std::uint16_t kDefaultPort = 5004;  // RFC 3551 section 8
constexpr int kReceiveBuffer = 64 << 20;      // half a second at 1 Gbit/s
constexpr std::size_t kBatch = 64;            // datagrams a system call
constexpr std::size_t kSlotBytes = 1 << 16;   // no UDP payload is larger
constexpr int kBatchesPerTurn = 32;           // then signals and timers get their turn
constexpr Time kTick = std::chrono::milliseconds(100);

Time to_time(const timespec& t) {
    return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

Time wall_clock() {
    timespec t{};
    clock_gettime(CLOCK_REALTIME, &t);
    return to_time(t);
}

Source source_of(const sockaddr_storage& address) {
    Source source;
    if (address.ss_family == AF_INET6) {
        sockaddr_in6 v6{};
        std::memcpy(&v6, &address, sizeof(v6));
        std::memcpy(source.address.data(), &v6.sin6_addr, 16);
        std::memcpy(source.address.data() + 16, &v6.sin6_scope_id, 4);
        source.port = ntohs(v6.sin6_port);
    } else if (address.ss_family == AF_INET) {
        sockaddr_in v4{};
        std::memcpy(&v4, &address, sizeof(v4));
        source.address[10] = source.address[11] = 0xff;
        std::memcpy(source.address.data() + 12, &v4.sin_addr, 4);
        source.port = ntohs(v4.sin_port);
    }
    return source;
}

std::string text_of(const udp::endpoint& endpoint) {
    const std::string address = endpoint.address().to_string();
    const std::string port = std::to_string(endpoint.port());
    return (endpoint.address().is_v6() ? "[" + address + "]:" : address + ":") + port;
}

// What a recvmmsg call fills.
class Batch {
  public:
    Batch() : bytes_(kBatch * kSlotBytes) {}

    /// Number of datagrams taken; 0 when none waits, or the socket had an error to tell (which for
    /// UDP concerns no later datagram).
    std::size_t receive(int socket) {
        for (std::size_t k = 0; k < kBatch; ++k) prepare(k);
        const int count = recvmmsg(socket, messages_.data(), kBatch, MSG_DONTWAIT, nullptr);
        return count > 0 ? static_cast<std::size_t>(count) : 0;
    }
    [[nodiscard]] std::span<const std::uint8_t> bytes(std::size_t k) const {
        return {bytes_.data() + k * kSlotBytes, messages_[k].msg_len};
    }
    [[nodiscard]] Source source(std::size_t k) const { return source_of(names_[k]); }

    /// Calls visit(cmsg) for each control message of datagram k.
    template <class Visit>
    void for_each_control(std::size_t k, Visit&& visit) {
        msghdr* const header = &messages_[k].msg_hdr;
        for (cmsghdr* c = CMSG_FIRSTHDR(header); c != nullptr; c = CMSG_NXTHDR(header, c)) {
            visit(*c);
        }
    }

  private:
    struct alignas(cmsghdr) Control {
        std::array<unsigned char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))>
            bytes;
    };
    void prepare(std::size_t k) {
        slots_[k] = {bytes_.data() + k * kSlotBytes, kSlotBytes};
        msghdr& header = messages_[k].msg_hdr;
        header = {};
        header.msg_name = &names_[k];
        header.msg_namelen = sizeof(names_[k]);
        header.msg_iov = &slots_[k];
        header.msg_iovlen = 1;
        header.msg_control = controls_[k].bytes.data();
        header.msg_controllen = controls_[k].bytes.size();
    }

    std::vector<std::uint8_t> bytes_;
    std::array<mmsghdr, kBatch> messages_{};
    std::array<iovec, kBatch> slots_{};
    std::array<sockaddr_storage, kBatch> names_{};
    std::array<Control, kBatch> controls_{};
};

udp::endpoint endpoint_of(asio::io_context& io, const common::Endpoint& listen) {
    const std::uint16_t port = listen.port.value_or(kDefaultPort);
    if (listen.host.empty()) return {udp::v6(), port};
    error_code error;
    udp::resolver resolver(io);
    const auto found =
        resolver.resolve(listen.host, std::to_string(port), udp::resolver::passive, error);
    if (error || found.empty()) {
        throw ListenError("cannot listen on '" + listen.host + "': " + error.message());
    }
    return found.begin()->endpoint();
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
    Batch batch;
    std::uint32_t drops_seen = 0;  // the kernel's counter, modulo 2^32
    std::uint64_t drops = 0;
    Time latest{};  // handed to the session; its time must not run backwards
    Session* session = nullptr;
    std::function<void(Time)> on_tick;

    void open(udp::endpoint endpoint, bool any);
    void set_options();
    void note_drops(std::uint32_t counter);
    void wait_for_datagrams();
    void wait_for_tick();
    bool drain(int batches);
    void take(std::size_t count);
    void stop_if_finished();
    Time advance(Time to) { return latest = std::max(latest, to); }
};

void UdpEndpoint::Impl::open(udp::endpoint endpoint, bool any) {
    error_code error;
    socket.open(endpoint.protocol(), error);
    if (error && any) {  // a host without IPv6
        endpoint = {udp::v4(), endpoint.port()};
        socket.open(endpoint.protocol(), error);
    }
    if (!error && any && endpoint.protocol() == udp::v6()) {
        socket.set_option(asio::ip::v6_only(false), error);
    }
    if (!error) socket.bind(endpoint, error);
    if (error) {
        throw ListenError("cannot listen on " + text_of(endpoint) + ": " + error.message());
    }
    socket.non_blocking(true);
    set_options();
}

// Each is an improvement that reception can do without, so failures are let pass.
void UdpEndpoint::Impl::set_options() {
    const int fd = socket.native_handle();
    const int on = 1;
    const int size = kReceiveBuffer;
    if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof(size)) != 0) {
        setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &size, sizeof(size));  // up to net.core.rmem_max
    }
    setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on));
    setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on));
}

void UdpEndpoint::Impl::note_drops(std::uint32_t counter) {
    drops += static_cast<std::uint32_t>(counter - drops_seen);
    drops_seen = counter;
}

// Hands `count` datagrams of the batch to the session, each with the time at which the kernel took
// it.
void UdpEndpoint::Impl::take(std::size_t count) {
    const Time steady = UdpEndpoint::now();
    const Time wall = wall_clock();
    for (std::size_t k = 0; k < count; ++k) {
        Time age{};
        batch.for_each_control(k, [&](const cmsghdr& control) {
            if (control.cmsg_level != SOL_SOCKET) return;
            if (control.cmsg_type == SO_TIMESTAMPNS) {
                timespec stamp{};
                std::memcpy(&stamp, CMSG_DATA(&control), sizeof(stamp));
                age = wall - to_time(stamp);
            } else if (control.cmsg_type == SO_RXQ_OVFL) {
                std::uint32_t counter = 0;
                std::memcpy(&counter, CMSG_DATA(&control), sizeof(counter));
                note_drops(counter);
            }
        });
        // Bounds for when somebody sets the wall clock between the two.
        age = std::clamp<Time>(age, Time::zero(), std::chrono::seconds(5));
        session->on_datagram(advance(steady - age), batch.source(k), batch.bytes(k));
    }
}

// False when nothing more waits in the socket.
bool UdpEndpoint::Impl::drain(int batches) {
    for (int n = 0; n < batches && !session->finished(); ++n) {
        const std::size_t count = batch.receive(socket.native_handle());
        take(count);
        if (count < kBatch) return false;
    }
    return true;
}

void UdpEndpoint::Impl::stop_if_finished() {
    if (session->finished()) io.stop();
}

void UdpEndpoint::Impl::wait_for_datagrams() {
    socket.async_wait(udp::socket::wait_read, [this](const error_code& error) {
        if (error) return;
        drain(kBatchesPerTurn);
        stop_if_finished();
        wait_for_datagrams();
    });
}

void UdpEndpoint::Impl::wait_for_tick() {
    timer.expires_after(kTick);
    timer.async_wait([this](const error_code& error) {
        if (error) return;
        // Silence is only what remains when everything that waits was taken: we may have slept, not
        // they.
        const bool more = drain(kBatchesPerTurn);
        session->poll(more ? latest : advance(UdpEndpoint::now()));
        on_tick(latest);
        stop_if_finished();
        wait_for_tick();
    });
}

UdpEndpoint::UdpEndpoint(const common::Endpoint& listen) : impl_(std::make_unique<Impl>()) {
    impl_->open(endpoint_of(impl_->io, listen), listen.host.empty());
    impl_->signals.add(SIGINT);
    impl_->signals.add(SIGTERM);
}

UdpEndpoint::~UdpEndpoint() = default;

void UdpEndpoint::run(Session& session, const std::function<void(Time)>& on_tick) {
    Impl& impl = *impl_;
    impl.session = &session;
    impl.on_tick = on_tick;
    impl.signals.async_wait([&impl](const error_code& error, int) {
        if (error) return;
        impl.drain(kBatchesPerTurn);  // what has arrived was received
        impl.session->interrupt(impl.advance(UdpEndpoint::now()));
        impl.stop_if_finished();
    });
    impl.wait_for_datagrams();
    impl.wait_for_tick();
    impl.io.run();

    // Drops after the last datagram were announced by none; this is the same counter.
    std::array<std::uint32_t, SK_MEMINFO_VARS> info{};
    socklen_t size = sizeof(info);
    const int fd = impl.socket.native_handle();
    if (getsockopt(fd, SOL_SOCKET, SO_MEMINFO, info.data(), &size) == 0 &&
        size > SK_MEMINFO_DROPS * sizeof(std::uint32_t)) {
        impl.note_drops(info[SK_MEMINFO_DROPS]);
    }
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
    return impl_->drops;
}

}  // namespace ellicast::receiver
