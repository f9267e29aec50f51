#include "receiver/receive_thread.hpp"

#include <netinet/in.h>
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

constexpr std::size_t kRingBytes = std::size_t{32} << 20;  // a quarter of a second at 1 Gbit/s
constexpr std::size_t kBatch = 64;                         // datagrams a system call

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
        std::array<unsigned char, CMSG_SPACE(sizeof(timespec))> bytes;
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
        take_in(batch, count);
        in_hand_ = false;
        if (count == 0) wait_for_datagrams();
    }
}

void ReceiveThread::tell() {
    ring_.publish();
    if (!told_.exchange(true)) on_news_();
}

void ReceiveThread::take_in(Batch& batch, std::size_t count) {
    if (count == 0) return;
    const Time now = steady_clock();
    const Time wall = wall_clock();
    for (std::size_t k = 0; k < count; ++k) {
        Time stamp = wall;
        batch.for_each_control(k, [&](const cmsghdr& control) {
            if (control.cmsg_level != SOL_SOCKET) return;
            if (control.cmsg_type == SO_TIMESTAMPNS) {
                timespec t{};
                std::memcpy(&t, CMSG_DATA(&control), sizeof(t));
                stamp = to_time(t);
            }
        });
        const Time arrived = arrival_time(now, wall, stamp, socket_empty_);
        while (!ring_.push({arrived, batch.source(k), batch.bytes(k)})) {
            tell();
            wait_for_room();
            if (stop_) return;
        }
    }
    tell();
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
