#include "receiver/datagram_ring.hpp"

#include <cassert>
#include <cstring>
#include <limits>

namespace ellicast::receiver {
namespace {

constexpr std::uint32_t kSkip = std::numeric_limits<std::uint32_t>::max();

}  // namespace

DatagramRing::DatagramRing(std::size_t bytes)
    : size_(bytes / kUnit * kUnit),
      bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(bytes / kUnit * kUnit)) {
    assert(bytes >= kLeastBytes);
    static_assert(sizeof(Head) <= kUnit && kLeastBytes >= 2 * (kMaxDatagram + 2 * kUnit));
}

/// Of a datagram with its head. A head takes no more than a unit, so that it always finds place
/// before the memory's end.
std::size_t DatagramRing::room_for(std::size_t bytes) {
    return (sizeof(Head) + bytes + kUnit - 1) / kUnit * kUnit;
}

std::uint8_t* DatagramRing::place(std::uint64_t position) const {
    return bytes_.get() + position % size_;
}

std::size_t DatagramRing::until_end(std::uint64_t position) const {
    return size_ - position % size_;
}

/// Up to where memory is free.
std::uint64_t DatagramRing::position_read() const {
    const std::uint64_t read = read_.load(std::memory_order_acquire);
    return read == jump_from_ ? jump_to_ : read;
}

void DatagramRing::rewind() {
    if (write_ % size_ == 0 || read_.load(std::memory_order_acquire) != write_) return;
    jump_from_ = write_;
    write_ += until_end(write_);
    jump_to_ = read_known_ = write_;
}

bool DatagramRing::push(const Arrival& arrival) {
    assert(arrival.bytes.size() <= kMaxDatagram);
    const std::size_t room = room_for(arrival.bytes.size());
    const std::size_t skipped = until_end(write_) < room ? until_end(write_) : 0;
    const std::uint64_t end = write_ + skipped + room;
    if (end - read_known_ > size_) {
        read_known_ = position_read();
        if (end - read_known_ > size_) return false;
    }
    Head head{arrival.time, arrival.source.address, arrival.source.port, kSkip};
    if (skipped > 0) {
        std::memcpy(place(write_), &head, sizeof head);
        write_ += skipped;
    }
    head.size = static_cast<std::uint32_t>(arrival.bytes.size());
    std::uint8_t* const to = place(write_);
    std::memcpy(to, &head, sizeof head);
    if (!arrival.bytes.empty()) {
        std::memcpy(to + sizeof head, arrival.bytes.data(), arrival.bytes.size());
    }
    write_ = end;
    return true;
}

/// Reads the datagram at a position; gives the next one's.
std::uint64_t DatagramRing::next(std::uint64_t at, Arrival& arrival) const {
    Head head;
    std::memcpy(&head, place(at), sizeof head);
    if (head.size == kSkip) {
        at += until_end(at);
        std::memcpy(&head, place(at), sizeof head);
    }
    arrival = {head.time, {head.address, head.port, {}}, {place(at) + sizeof head, head.size}};
    return at + room_for(head.size);
}

}  // namespace ellicast::receiver
