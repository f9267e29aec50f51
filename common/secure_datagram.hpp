// common/secure_datagram.hpp: keys, and what they do to the bytes of a datagram (libsodium).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace ellicast::common {

inline constexpr std::size_t kSealTagBytes = 16;
inline constexpr std::size_t kSignatureBytes = 64;

using ConstBytes = std::span<const std::uint8_t>;
using PublicKey = std::array<std::uint8_t, 32>;  // Ed25519 [RFC 8032]
using KeyId = std::array<std::uint8_t, 8>;
using SessionBytes = std::array<std::uint8_t, 8>;

/// First 8 bytes of the 32-byte BLAKE2b digest of the key. Tells keys apart; whoever wants can make
/// two keys of one id, and gains nothing.
KeyId key_id(const PublicKey& key);

/// Overwrites the bytes in a way that no compiler leaves out.
void wipe(std::span<std::uint8_t> bytes);

/// Bytes that are wiped when they go.
template <std::size_t N>
class Secret {
  public:
    explicit Secret(const std::array<std::uint8_t, N>& bytes) : bytes_(bytes) {}
    ~Secret() { wipe(bytes_); }
    Secret(const Secret&) = default;
    Secret(Secret&&) noexcept = default;
    Secret& operator=(const Secret&) = default;
    Secret& operator=(Secret&&) noexcept = default;
    [[nodiscard]] const std::array<std::uint8_t, N>& bytes() const { return bytes_; }

  private:
    std::array<std::uint8_t, N> bytes_;
};

/// The private half of an Ed25519 pair: 32 bytes of seed, 32 bytes of public key.
class SigningKey {
  public:
    static constexpr std::size_t kBytes = 64;

    /// From the operating system's random source.
    static SigningKey random();
    /// Empty when the public half is not that of the seed: a damaged key.
    static std::optional<SigningKey> of_bytes(const std::array<std::uint8_t, kBytes>& bytes);
    /// The pair that belongs to the seed.
    static SigningKey of_seed(const std::array<std::uint8_t, 32>& seed);

    [[nodiscard]] const std::array<std::uint8_t, kBytes>& bytes() const { return secret_.bytes(); }
    [[nodiscard]] PublicKey public_key() const;
    /// Deterministic: one message, one signature. About 20 us and two passes over the message.
    void sign(ConstBytes message, std::span<std::uint8_t, kSignatureBytes> signature) const;

  private:
    explicit SigningKey(const std::array<std::uint8_t, kBytes>& bytes) : secret_(bytes) {}
    Secret<kBytes> secret_;
};

/// True when the holder of the key's private half signed exactly these bytes. Refuses keys of small
/// order and signatures that are not in canonical form, so that no bit of a signature is free.
/// About 60 us and a pass over the message. May be called from several threads.
bool verifies(const PublicKey& key, ConstBytes message,
              std::span<const std::uint8_t, kSignatureBytes> signature);

/// What senders and receivers of sealed streams have in common: 32 secret random bytes.
class SharedKey {
  public:
    static constexpr std::size_t kBytes = 32;

    static SharedKey random();
    explicit SharedKey(const std::array<std::uint8_t, kBytes>& bytes) : secret_(bytes) {}
    [[nodiscard]] const std::array<std::uint8_t, kBytes>& bytes() const { return secret_.bytes(); }
    /// Names the key without telling it.
    [[nodiscard]] std::array<std::uint8_t, 32> fingerprint() const;

  private:
    Secret<kBytes> secret_;
};

/// XChaCha20-Poly1305 for the datagrams of one session. The key is the 32-byte BLAKE2b of the
/// session id under the shared key, the nonce is the session id, a counter (big-endian) and eight
/// zeros: as long as session ids come from a true random source, no nonce serves twice under a key
/// unless a counter does.
class SessionSeal {
  public:
    SessionSeal(const SharedKey& key, const SessionBytes& session);

    [[nodiscard]] const SessionBytes& session() const { return session_; }

    /// Encrypts `body` in place and tags it together with `associated`, which stays in clear.
    /// Requires a counter that this session has not used before.
    void seal(std::uint64_t counter, ConstBytes associated, std::span<std::uint8_t> body,
              std::span<std::uint8_t, kSealTagBytes> tag) const;

    /// Decrypts into `body`, as large as `sealed` (asserted). False, and nothing to be used in
    /// `body`, when the tag is not that of these bytes.
    [[nodiscard]] bool open(std::uint64_t counter, ConstBytes associated, ConstBytes sealed,
                            std::span<const std::uint8_t, kSealTagBytes> tag,
                            std::span<std::uint8_t> body) const;

  private:
    SessionBytes session_;
    Secret<32> key_;
};

}  // namespace ellicast::common
