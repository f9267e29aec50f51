#include "receiver/receive_thread.hpp"

#include <netinet/in.h>
#include <netinet/udp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <utility>

namespace ellicast::receiver {
namespace {

// A second at 1 Gbit/s; what never waited at one time takes no memory.
constexpr std::size_t kRingBytes = std::size_t{128} << 20;
constexpr std::size_t kBatch = 64;  // datagrams a system call

// Batches in a row that the socket filled: whoever keeps up finds a few datagrams at a time.
constexpr int kBehind = 8;

// How long a datagram may have waited for the thread to begin.
constexpr Time kOldest = std::chrono::seconds(5);

// From one datagram's place in a batch to the next one's. Not a power of two: their first bytes
// would all fall into the same few lines of the cache.
constexpr std::size_t kStride = DatagramRing::kMaxDatagram + 192;

Time to_time(const timespec& t) {
    return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

Time wall_clock() {
    timespec t{};
    clock_gettime(CLOCK_REALTIME, &t);
    return to_time(t);
}

Time steady_clock() {
    return std::chrono::steady_clock::now().time_since_epoch();
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

}  // namespace

// What a recvmmsg call fills.
class ReceiveThread::Batch {
  public:
    Batch() : bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(kBatch * kStride)) {}

    /// Number of datagrams taken; 0 when none waits, or the socket had an error to tell (which for
    /// UDP concerns no later datagram).
    std::size_t receive(int socket) {
        for (std::size_t k = 0; k < kBatch; ++k) prepare(k);
        const int count = recvmmsg(socket, messages_.data(), kBatch, MSG_DONTWAIT, nullptr);
        return count > 0 ? static_cast<std::size_t>(count) : 0;
    }
    [[nodiscard]] std::span<const std::uint8_t> bytes(std::size_t k) const {
        return {bytes_.get() + k * kStride, messages_[k].msg_len};
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
        std::array<unsigned char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(int))> bytes;
    };
    void prepare(std::size_t k) {
        slots_[k] = {bytes_.get() + k * kStride, DatagramRing::kMaxDatagram};
        msghdr& header = messages_[k].msg_hdr;
        header = {};
        header.msg_name = &names_[k];
        header.msg_namelen = sizeof(names_[k]);
        header.msg_iov = &slots_[k];
        header.msg_iovlen = 1;
        header.msg_control = controls_[k].bytes.data();
        header.msg_controllen = controls_[k].bytes.size();
    }

    std::unique_ptr<std::uint8_t[]> bytes_;
    std::array<mmsghdr, kBatch> messages_{};
    std::array<iovec, kBatch> slots_{};
    std::array<sockaddr_storage, kBatch> names_{};
    std::array<Control, kBatch> controls_{};
};

ReceiveThread::ReceiveThread(int socket, std::function<void()> on_news)
    : socket_(socket),
      on_news_(std::move(on_news)),
      ring_(kRingBytes),
      wish_to_stop_(::eventfd(0, EFD_CLOEXEC)),
      socket_empty_(steady_clock() - kOldest) {
    if (wish_to_stop_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    thread_ = std::thread([this] { run(); });
}

ReceiveThread::~ReceiveThread() {
    stop_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wish_to_stop_, &one, sizeof one);
    thread_.join();
    ::close(wish_to_stop_);
}

bool ReceiveThread::unsettled() {
    if (!ring_.empty()) return true;
    told_.exchange(false);  // reads what tell() wrote, so that we see what was put in before it
    // What came meanwhile: either it was told again, or it is ours still.
    return !ring_.empty() && !told_.exchange(true);
}

bool ReceiveThread::caught_up() const {
    ::pollfd socket{socket_, POLLIN, 0};
    if (::poll(&socket, 1, 0) > 0 && (socket.revents & POLLIN) != 0) return false;
    // What is no longer in the socket is in hand, or it is in the ring.
    return !in_hand_ && ring_.empty();
}

void ReceiveThread::run() {
    Batch batch;
    while (!stop_) {
        in_hand_ = true;
        const Time before = steady_clock();
        const std::size_t count = batch.receive(socket_);
        if (count == 0) socket_empty_ = before;
        ask_for_pieces(count);
        take_in(batch, count);
        in_hand_ = false;
        if (count == 0) wait_for_datagrams();
    }
}

void ReceiveThread::tell() {
    ring_.publish();
    if (!told_.exchange(true)) on_news_();
}

/// For good: what waits in pieces could not be told from single datagrams any more.
void ReceiveThread::ask_for_pieces(std::size_t count) {
    full_batches_ = count < kBatch ? 0 : full_batches_ + 1;
    if (full_batches_ != kBehind) return;
    const int on = 1;
    (void)::setsockopt(socket_, IPPROTO_UDP, UDP_GRO, &on, sizeof on);  // an old kernel has none
}

void ReceiveThread::take_in(Batch& batch, std::size_t count) {
    if (count == 0) return;
    const Time now = steady_clock();
    const Time wall = wall_clock();
    ring_.rewind();
    std::uint64_t datagrams = 0;
    for (std::size_t k = 0; k < count; ++k) {
        Time stamp = wall;
        std::span<const std::uint8_t> rest = batch.bytes(k);
        std::size_t size = rest.size();
        batch.for_each_control(k, [&](const cmsghdr& control) {
            if (control.cmsg_level == SOL_SOCKET && control.cmsg_type == SO_TIMESTAMPNS) {
                timespec t{};
                std::memcpy(&t, CMSG_DATA(&control), sizeof(t));
                stamp = to_time(t);
            }
            if (control.cmsg_level == IPPROTO_UDP && control.cmsg_type == UDP_GRO) {
                int each = 0;
                std::memcpy(&each, CMSG_DATA(&control), sizeof(each));
                if (each > 0) size = static_cast<std::size_t>(each);
            }
        });
        const Time arrived = arrival_time(now, wall, stamp, socket_empty_);
        const Source source = batch.source(k);
        do {  // once for a datagram without bytes
            const std::size_t here = std::min(size, rest.size());
            if (!put_in({arrived, source, rest.first(here)})) return;
            rest = rest.subspan(here);
            ++datagrams;
        } while (!rest.empty());
    }
    datagrams_ += datagrams;
    pieces_ += count;
    tell();
}

/// Waits for room. False when there is none and we are to stop.
bool ReceiveThread::put_in(const Arrival& arrival) {
    while (!ring_.push(arrival)) {
        tell();
        wait_for_room();
        if (stop_) return false;
    }
    return true;
}

void ReceiveThread::wait_for_datagrams() const {
    std::array<::pollfd, 2> both{{{socket_, POLLIN, 0}, {wish_to_stop_, POLLIN, 0}}};
    ::poll(both.data(), both.size(), -1);
}

/// Not long: meanwhile the kernel's buffer fills.
void ReceiveThread::wait_for_room() const {
    ::pollfd stop{wish_to_stop_, POLLIN, 0};
    ::poll(&stop, 1, 1);
}

}  // namespace ellicast::receiver
