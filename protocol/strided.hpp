#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ellicast::protocol {

/// Every stride-th element of an array, without a copy.
template <class T>
class Strided {
  public:
    /// All of them.
    Strided(std::span<const T> all) : first_(all.data()), stride_(1), size_(all.size()) {}
    Strided(const auto& container) requires requires {
        std::span<const T>(container);
    } : Strided(std::span<const T>(container)) {
    }

    /// Elements first, first + stride, ..., `count` of them; they must be there (asserted).
    Strided(std::span<const T> all, std::size_t first, std::size_t stride, std::size_t count)
        : first_(all.data() + first), stride_(stride), size_(count) {
        assert(count == 0 || first + (count - 1) * stride < all.size());
    }

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    /// Requires k < size().
    const T& operator[](std::size_t k) const { return first_[k * stride_]; }

    /// Asks for an element, of which it may be known that nobody has it in a cache. Any k will do.
    void prefetch(std::size_t k) const {
#ifdef __GNUC__
        const auto address = reinterpret_cast<std::uintptr_t>(first_) + k * stride_ * sizeof(T);
        __builtin_prefetch(reinterpret_cast<const void*>(address));  // never faults
#endif
    }

  private:
    const T* first_;
    std::size_t stride_;
    std::size_t size_;
};

}  // namespace ellicast::protocol
