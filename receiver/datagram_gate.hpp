// receiver/datagram_gate.hpp
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/secure_datagram.hpp"
#include "protocol/secured_datagram.hpp"
#include "receiver/arrival.hpp"
#include "receiver/record_store.hpp"
#include "receiver/session_starts.hpp"

namespace ellicast::receiver {

/// Why a datagram of right form was not let in. WIRE_FORMAT.md section 13.3 has the order.
enum class Refusal : std::uint8_t {
    other_payload_type,  // of RTP than was agreed upon
    no_key,              // sealed, and we have no shared key
    not_sealed,          // and we have one
    not_signed,          // and we verify
    unknown_key,         // signed with a key that we do not verify
    bad_tag,             // not what a holder of the shared key sealed
    bad_signature,       // not what the holder of the private key signed
    replayed,            // of a session older than one that was accepted
    out_of_date,         // sent too far from our clock
    kCount
};
/// The report's key.
std::string_view to_string(Refusal refusal);

using RefusalCounts = std::array<std::uint64_t, static_cast<std::size_t>(Refusal::kCount)>;

struct GateOptions {
    std::optional<std::uint8_t> payload_type{};        // of RTP; empty: any
    std::vector<common::PublicKey> verify;             // empty: signatures are not looked at
    std::optional<common::SharedKey> psk;              // empty: only what is not sealed gets in
    std::optional<std::chrono::microseconds> max_age;  // of sending times, either way
    bool refuse_older_sessions = false;
    SessionStarts starts;  // known from earlier runs
    /// Datagrams, and bytes, that may wait for the look at their signatures.
    std::size_t queue = 16'384;
    std::size_t queue_bytes = std::size_t{1} << 25;
    unsigned threads = 0;  // that look at signatures; 0: one per core
};

/// What stands between the network and the session's books: it takes datagrams as they came, and
/// hands on the clear form of those that the keys admit, with what the keys say of them as part of
/// their source. Where signatures are verified, datagrams wait in a bounded queue. In it, sources
/// of which something was verified before come first; when it is full, others make room for them
/// and the rest is dropped. Which datagrams are handed on, and in which order, follows from the
/// order of the calls alone, on any number of threads. Pure: moments and clock are arguments.
class DatagramGate {
  public:
    /// `clear` holds only during the call.
    using Deliver = std::function<void(Time arrived, const Source& source,
                                       std::span<const std::uint8_t> clear)>;
    /// Signatures looked at in one call of work(), at most: some milliseconds.
    static constexpr std::size_t kBatch = 128;

    explicit DatagramGate(GateOptions options);

    /// True when these bytes need not pass the gate: clear, and nothing else is asked for.
    [[nodiscard]] bool stands_open_for(std::span<const std::uint8_t> bytes) const {
        return open_ && is_of_agreed_type(bytes) && !protocol::protection_of(bytes).any();
    }

    /// Takes a datagram in: drops it, delivers it, or has it wait. Gives the fault when its form is
    /// wrong. Microseconds; of an unsigned one linear in its bytes.
    std::optional<protocol::WireError> offer(Time now, const Source& source,
                                             std::span<const std::uint8_t> bytes,
                                             const Deliver& deliver);

    /// Verifies up to kBatch of those that wait and delivers the good ones, at moments that do not
    /// run backwards. True when more wait.
    bool work(const Deliver& deliver);
    [[nodiscard]] std::size_t waiting() const { return known_.size() + strangers_.size(); }

    /// The local clock showed `since_1970` at `now`. Without it max_age refuses nothing.
    void set_clock(Time now, std::chrono::microseconds since_1970);

    [[nodiscard]] const RefusalCounts& refused() const { return refused_; }
    [[nodiscard]] std::uint64_t unverified_dropped() const { return dropped_; }
    /// Authentic datagrams that were let in.
    [[nodiscard]] std::uint64_t admitted() const { return admitted_; }
    [[nodiscard]] const SessionStarts& starts() const { return options_.starts; }

  private:
    struct Waiting {
        Time arrived{};
        Source source;  // with what is known already: the key that is to be verified
        std::vector<std::uint8_t> bytes;
        std::vector<std::uint8_t> sections;  // opened; empty when not sealed
        [[nodiscard]] std::size_t size() const { return bytes.size() + sections.size(); }
    };

    [[nodiscard]] bool is_of_agreed_type(std::span<const std::uint8_t> bytes) const {
        return !options_.payload_type ||
               (bytes.size() > 1 && (bytes[1] & 0x7f) == *options_.payload_type);
    }
    void refuse(Refusal why) { ++refused_[static_cast<std::size_t>(why)]; }
    std::optional<protocol::WireError> refuse_clear(std::span<const std::uint8_t> bytes);
    [[nodiscard]] const common::PublicKey* key_of(const protocol::SecuredView& view) const;
    [[nodiscard]] bool open_sections(const protocol::SecuredView& view);
    void enqueue(Waiting datagram, const protocol::SessionId& session);
    [[nodiscard]] bool has_room(std::size_t bytes) const;
    std::vector<Waiting> next_batch();
    void admit(Time arrived, const Source& source, const protocol::SecuredView& view,
               std::span<const std::uint8_t> sections, const Deliver& deliver);
    [[nodiscard]] std::optional<Refusal> judge_times(Time arrived, const SessionStarts::Key& key,
                                                     const protocol::SecurityHeader& times) const;
    [[nodiscard]] bool is_known(const SenderKey& sender) const;
    void remember(const SenderKey& sender);

    GateOptions options_;
    std::vector<protocol::KeyId> key_ids_;
    SessionStarts::Key psk_fingerprint_{};
    bool open_;
    std::optional<common::SessionSeal> seal_;  // of the last sealed session
    std::vector<std::uint8_t> opened_;         // sections of the datagram in hand
    std::deque<Waiting> known_;
    std::deque<Waiting> strangers_;
    std::size_t waiting_bytes_ = 0;
    std::vector<SenderKey> verified_senders_;         // the latest last
    std::optional<std::chrono::microseconds> clock_;  // 1970 to the zero of Time
    Time latest_{};
    RefusalCounts refused_{};
    std::uint64_t dropped_ = 0;
    std::uint64_t admitted_ = 0;
};

}  // namespace ellicast::receiver
