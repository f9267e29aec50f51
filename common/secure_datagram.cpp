// common/secure_datagram.cpp
#include "common/secure_datagram.hpp"

#include <sodium.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <string_view>

#include "common/object_id.hpp"

namespace ellicast::common {
namespace {

static_assert(SigningKey::kBytes == crypto_sign_SECRETKEYBYTES);
static_assert(sizeof(PublicKey) == crypto_sign_PUBLICKEYBYTES);
static_assert(kSignatureBytes == crypto_sign_BYTES);
static_assert(SharedKey::kBytes == crypto_aead_xchacha20poly1305_ietf_KEYBYTES);
static_assert(kSealTagBytes == crypto_aead_xchacha20poly1305_ietf_ABYTES);

using Nonce = std::array<std::uint8_t, crypto_aead_xchacha20poly1305_ietf_NPUBBYTES>;

/// Before the first use of libsodium; picks its fast code and opens its random source.
void prepare() {
    static const bool ready = sodium_init() >= 0;
    if (!ready) throw std::runtime_error("libsodium cannot be initialised");
}

template <std::size_t N>
std::array<std::uint8_t, N> random_bytes() {
    prepare();
    std::array<std::uint8_t, N> bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    return bytes;
}

/// 32-byte BLAKE2b of the message under the key.
std::array<std::uint8_t, 32> keyed_digest(const SharedKey& key, ConstBytes message) {
    prepare();
    std::array<std::uint8_t, 32> digest{};
    [[maybe_unused]] const int failed =
        crypto_generichash(digest.data(), digest.size(), message.data(), message.size(),
                           key.bytes().data(), key.bytes().size());
    assert(failed == 0);
    return digest;
}

Nonce nonce_of(const SessionBytes& session, std::uint64_t counter) {
    Nonce nonce{};
    std::ranges::copy(session, nonce.begin());
    for (std::size_t k = 0; k < 8; ++k) {
        nonce[session.size() + k] = static_cast<std::uint8_t>(counter >> (56 - 8 * k));
    }
    return nonce;
}

}  // namespace

KeyId key_id(const PublicKey& key) {
    Digest digest;
    digest.update(key);
    return digest.finish8();
}

void wipe(std::span<std::uint8_t> bytes) {
    sodium_memzero(bytes.data(), bytes.size());
}

SigningKey SigningKey::of_seed(const std::array<std::uint8_t, 32>& seed) {
    prepare();
    PublicKey unused{};
    std::array<std::uint8_t, kBytes> bytes{};
    crypto_sign_seed_keypair(unused.data(), bytes.data(), seed.data());
    SigningKey key(bytes);
    wipe(bytes);
    return key;
}

SigningKey SigningKey::random() {
    auto seed = random_bytes<32>();
    SigningKey key = of_seed(seed);
    wipe(seed);
    return key;
}

std::optional<SigningKey> SigningKey::of_bytes(const std::array<std::uint8_t, kBytes>& bytes) {
    std::array<std::uint8_t, 32> seed{};
    std::copy_n(bytes.begin(), seed.size(), seed.begin());
    SigningKey key = of_seed(seed);
    wipe(seed);
    if (key.bytes() != bytes) return std::nullopt;
    return key;
}

PublicKey SigningKey::public_key() const {
    PublicKey key{};
    std::copy_n(bytes().end() - key.size(), key.size(), key.begin());
    return key;
}

void SigningKey::sign(ConstBytes message,
                      std::span<std::uint8_t, kSignatureBytes> signature) const {
    crypto_sign_detached(signature.data(), nullptr, message.data(), message.size(), bytes().data());
}

bool verifies(const PublicKey& key, ConstBytes message,
              std::span<const std::uint8_t, kSignatureBytes> signature) {
    prepare();
    return crypto_sign_verify_detached(signature.data(), message.data(), message.size(),
                                       key.data()) == 0;
}

SharedKey SharedKey::random() {
    auto bytes = random_bytes<kBytes>();
    SharedKey key(bytes);
    wipe(bytes);
    return key;
}

std::array<std::uint8_t, 32> SharedKey::fingerprint() const {
    constexpr std::string_view kPurpose = "ellicast fingerprint";  // no session id is so long
    return keyed_digest(*this,
                        {reinterpret_cast<const std::uint8_t*>(kPurpose.data()), kPurpose.size()});
}

SessionSeal::SessionSeal(const SharedKey& key, const SessionBytes& session)
    : session_(session), key_(keyed_digest(key, session)) {}

void SessionSeal::seal(std::uint64_t counter, ConstBytes associated, std::span<std::uint8_t> body,
                       std::span<std::uint8_t, kSealTagBytes> tag) const {
    const Nonce nonce = nonce_of(session_, counter);
    crypto_aead_xchacha20poly1305_ietf_encrypt_detached(
        body.data(), tag.data(), nullptr, body.data(), body.size(), associated.data(),
        associated.size(), nullptr, nonce.data(), key_.bytes().data());
}

bool SessionSeal::open(std::uint64_t counter, ConstBytes associated, ConstBytes sealed,
                       std::span<const std::uint8_t, kSealTagBytes> tag,
                       std::span<std::uint8_t> body) const {
    assert(body.size() == sealed.size());
    const Nonce nonce = nonce_of(session_, counter);
    return crypto_aead_xchacha20poly1305_ietf_decrypt_detached(
               body.data(), nullptr, sealed.data(), sealed.size(), tag.data(), associated.data(),
               associated.size(), nonce.data(), key_.bytes().data()) == 0;
}

}  // namespace ellicast::common
