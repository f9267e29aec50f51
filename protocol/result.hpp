// protocol/result.hpp
#pragma once

#include <cassert>
#include <utility>
#include <variant>

namespace ellicast::protocol {

/// Either a value or the reason why there is none; for peers' faults, which are normal and never
/// thrown.
template <class T, class E>
class Result {
  public:
    // Implicit, so that `return WireError::bad_hint;` reads as it should. NOLINTBEGIN(*-explicit-*)
    Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}
    Result(E error) : content_(std::in_place_index<1>, std::move(error)) {}
    // NOLINTEND(*-explicit-*)
    /// With a value of its own making, to be filled where it is: for what is large to move.
    explicit Result(std::in_place_t) : content_(std::in_place_index<0>) {}

    [[nodiscard]] bool has_value() const { return content_.index() == 0; }
    explicit operator bool() const { return has_value(); }

    /// Requires has_value() (asserted).
    T& operator*() { return value(); }
    const T& operator*() const { return value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }

    /// Requires !has_value() (asserted).
    [[nodiscard]] const E& error() const {
        assert(!has_value());
        return *std::get_if<1>(&content_);
    }

  private:
    T& value() {
        assert(has_value());
        return *std::get_if<0>(&content_);
    }
    const T& value() const {
        assert(has_value());
        return *std::get_if<0>(&content_);
    }

    std::variant<T, E> content_;
};

}  // namespace ellicast::protocol
