// common/object_id.hpp
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ellicast::common {

/// Incremental BLAKE2b ([RFC 7693], libsodium) with a short digest.
class Digest {
  public:
    Digest();
    void update(std::span<const std::uint8_t> bytes);
    /// First 8 bytes of a 32-byte BLAKE2b digest of everything so far; may be called once.
    [[nodiscard]] std::array<std::uint8_t, 8> finish8();
    [[nodiscard]] std::array<std::uint8_t, 32> finish32();

  private:
    alignas(64) std::array<std::uint8_t, 384> state_{};
};

}  // namespace ellicast::common
