// receiver/datagram_gate.cpp
#include "receiver/datagram_gate.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/parallel.hpp"

namespace ellicast::receiver {
namespace {

using Bytes = std::span<const std::uint8_t>;

// Senders remembered as verified: more than anyone listens to at once, few enough to look through.
constexpr std::size_t kMostVerifiedSenders = 64;

// Below so many signatures starting a thread costs as much as it saves.
constexpr std::size_t kFewSignatures = 8;

Source with(const Source& source, const common::PublicKey* key,
            const protocol::Protection& protection) {
    Source out = source;
    if (key) out.authenticity.key = *key;
    out.authenticity.is_signed = protection.is_signed;
    out.authenticity.sealed = protection.sealed;
    return out;
}

// Where it came from, whatever keys say.
SenderKey place_of(const Source& source, const protocol::SessionId& session) {
    SenderKey sender{source, session};
    sender.source.authenticity = {};
    return sender;
}

}  // namespace

std::string_view to_string(Refusal refusal) {
    constexpr std::array<std::string_view, static_cast<std::size_t>(Refusal::kCount)> kNames{
        "other_payload_type", "no_key",   "not_sealed", "not_signed", "unknown_key", "bad_tag",
        "bad_signature",      "replayed", "out_of_date"};
    return kNames.at(static_cast<std::size_t>(refusal));
}

DatagramGate::DatagramGate(GateOptions options)
    : options_(std::move(options)), open_(options_.verify.empty() && !options_.psk) {
    for (const common::PublicKey& key : options_.verify) key_ids_.push_back(common::key_id(key));
    if (options_.psk) psk_fingerprint_ = options_.psk->fingerprint();
}

void DatagramGate::set_clock(Time now, std::chrono::microseconds since_1970) {
    clock_ = since_1970 - std::chrono::duration_cast<std::chrono::microseconds>(now);
}

std::optional<protocol::WireError> DatagramGate::offer(Time now, const Source& source, Bytes bytes,
                                                       const Deliver& deliver) {
    if (!protocol::protection_of(bytes).any()) return refuse_clear(bytes);
    const auto view = protocol::read_secured(bytes);
    if (!view) return view.error();
    const protocol::Protection& protection = view->protection;
    const bool verifying = !options_.verify.empty();
    const common::PublicKey* const key = key_of(*view);
    if (!is_of_agreed_type(bytes)) {
        refuse(Refusal::other_payload_type);
    } else if (protection.sealed != options_.psk.has_value()) {
        refuse(protection.sealed ? Refusal::no_key : Refusal::not_sealed);
    } else if (verifying && !key) {
        refuse(protection.is_signed ? Refusal::unknown_key : Refusal::not_signed);
    } else if (protection.sealed && !open_sections(*view)) {
        refuse(Refusal::bad_tag);
    } else if (verifying) {
        enqueue({now,
                 with(source, key, protection),
                 {bytes.begin(), bytes.end()},
                 protection.sealed ? opened_ : std::vector<std::uint8_t>{}},
                view->session);
    } else {
        admit(now, with(source, nullptr, protection), *view,
              protection.sealed ? Bytes(opened_) : view->parts.sections, deliver);
    }
    return std::nullopt;
}

/// What is clear where something else is asked for, or of another payload type; junk is told as
/// junk.
std::optional<protocol::WireError> DatagramGate::refuse_clear(Bytes bytes) {
    const auto datagram = protocol::parse_datagram(bytes);
    if (!datagram) return datagram.error();
    if (!is_of_agreed_type(bytes)) {
        refuse(Refusal::other_payload_type);
    } else {
        refuse(options_.psk ? Refusal::not_sealed : Refusal::not_signed);
    }
    return std::nullopt;
}

const common::PublicKey* DatagramGate::key_of(const protocol::SecuredView& view) const {
    if (!view.protection.is_signed) return nullptr;
    const auto found = std::find(key_ids_.begin(), key_ids_.end(), view.security.key);
    if (found == key_ids_.end()) return nullptr;
    return &options_.verify[static_cast<std::size_t>(found - key_ids_.begin())];
}

bool DatagramGate::open_sections(const protocol::SecuredView& view) {
    if (!seal_ || seal_->session() != view.session) seal_.emplace(*options_.psk, view.session);
    opened_.resize(view.parts.sections.size());
    return seal_->open(view.security.counter, view.parts.associated, view.parts.sections,
                       view.parts.tag.first<protocol::kTagBytes>(), opened_);
}

bool DatagramGate::has_room(std::size_t bytes) const {
    return waiting() < options_.queue && waiting_bytes_ + bytes <= options_.queue_bytes;
}

void DatagramGate::enqueue(Waiting datagram, const protocol::SessionId& session) {
    const bool known = is_known(place_of(datagram.source, session));
    while (known && !has_room(datagram.size()) && !strangers_.empty()) {
        waiting_bytes_ -= strangers_.back().size();
        strangers_.pop_back();
        ++dropped_;
    }
    if (!has_room(datagram.size())) {
        ++dropped_;
        return;
    }
    waiting_bytes_ += datagram.size();
    (known ? known_ : strangers_).push_back(std::move(datagram));
}

std::vector<DatagramGate::Waiting> DatagramGate::next_batch() {
    std::vector<Waiting> batch;
    for (std::deque<Waiting>* const queue : {&known_, &strangers_}) {
        while (batch.size() < kBatch && !queue->empty()) {
            waiting_bytes_ -= queue->front().size();
            batch.push_back(std::move(queue->front()));
            queue->pop_front();
        }
    }
    return batch;
}

bool DatagramGate::work(const Deliver& deliver) {
    const std::vector<Waiting> batch = next_batch();
    // Bytes, not bool: every thread writes its own.
    std::vector<std::uint8_t> good(batch.size(), 0);
    const auto verify = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto view = protocol::read_secured(batch[k].bytes);
            const bool right =
                common::verifies(batch[k].source.authenticity.key, view->covered,
                                 view->parts.signature.first<protocol::kSignatureBytes>());
            good[k] = right ? 1 : 0;
        }
    };
    common::parallel_for(batch.size(), batch.size() < kFewSignatures ? 1 : options_.threads,
                         verify);
    for (std::size_t k = 0; k < batch.size(); ++k) {
        const Waiting& datagram = batch[k];
        if (good[k] == 0) {
            refuse(Refusal::bad_signature);
            continue;
        }
        const auto view = protocol::read_secured(datagram.bytes);
        admit(datagram.arrived, datagram.source, *view,
              view->protection.sealed ? Bytes(datagram.sections) : view->parts.sections, deliver);
    }
    return waiting() > 0;
}

void DatagramGate::admit(Time arrived, const Source& source, const protocol::SecuredView& view,
                         Bytes sections, const Deliver& deliver) {
    const bool verified = source.authenticity.verified();
    // Times that nobody vouches for say nothing.
    if (verified || view.protection.sealed) {
        const SessionStarts::Key& key = verified ? source.authenticity.key : psk_fingerprint_;
        if (const auto why = judge_times(arrived, key, view.security)) {
            refuse(*why);
            return;
        }
        options_.starts.note(key, view.security.session_start_us);
    }
    if (verified) remember(place_of(source, view.session));
    ++admitted_;
    latest_ = std::max(latest_, arrived);
    deliver(latest_, source, protocol::make_clear(view, sections));
}

std::optional<Refusal> DatagramGate::judge_times(Time arrived, const SessionStarts::Key& key,
                                                 const protocol::SecurityHeader& times) const {
    if (options_.refuse_older_sessions && options_.starts.is_old(key, times.session_start_us)) {
        return Refusal::replayed;
    }
    if (!options_.max_age || !clock_) return std::nullopt;
    const auto now = std::chrono::duration_cast<std::chrono::microseconds>(arrived) + *clock_;
    const auto local = static_cast<std::uint64_t>(std::max<std::int64_t>(now.count(), 0));
    const std::uint64_t apart =
        local > times.sent_us ? local - times.sent_us : times.sent_us - local;
    if (apart > static_cast<std::uint64_t>(options_.max_age->count())) return Refusal::out_of_date;
    return std::nullopt;
}

bool DatagramGate::is_known(const SenderKey& sender) const {
    return std::find(verified_senders_.rbegin(), verified_senders_.rend(), sender) !=
           verified_senders_.rend();
}

void DatagramGate::remember(const SenderKey& sender) {
    if (!verified_senders_.empty() && verified_senders_.back() == sender) return;
    const auto known = std::find(verified_senders_.begin(), verified_senders_.end(), sender);
    if (known != verified_senders_.end()) {
        std::rotate(known, std::next(known), verified_senders_.end());
        return;
    }
    if (verified_senders_.size() == kMostVerifiedSenders) {
        verified_senders_.erase(verified_senders_.begin());
    }
    verified_senders_.push_back(sender);
}

}  // namespace ellicast::receiver
