#include "receiver/datagram_gate.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <map>
#include <utility>

#include "common/random.hpp"
#include "sender/datagram_security.hpp"
#include "tests/support/datagrams.hpp"

namespace {

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;
using tests::Datagram;

constexpr std::uint64_t kStart = 1'700'000'000'000'000;

sender::StreamKeys keys(bool sealed, bool is_signed, std::uint8_t which = 1) {
    sender::StreamKeys keys;
    if (sealed) keys.psk.emplace(std::array<std::uint8_t, 32>{which});
    if (is_signed) keys.sign = common::SigningKey::of_seed({which});
    return keys;
}

/// A gate for what these keys make.
GateOptions gate_for(const sender::StreamKeys& made) {
    GateOptions options;
    options.psk = made.psk;
    if (made.sign) options.verify = {made.sign->public_key()};
    return options;
}

const std::vector<Datagram>& clear_datagrams() {
    static const std::vector<Datagram> made = tests::made_datagrams(tests::made_sphere(900, 25));
    return made;
}

std::vector<Datagram> secured(const sender::StreamKeys& made, std::uint64_t start = kStart,
                              std::uint64_t since_start_us = 0) {
    sender::DatagramSecurity security(made, tests::MadeStream{}.session, start);
    std::vector<Datagram> out;
    for (const Datagram& clear : clear_datagrams()) {
        out.push_back(security.secure(clear, since_start_us));
    }
    return out;
}

Source source_at(std::uint8_t host, std::uint16_t port = 4000) {
    Source source;
    source.address[15] = host;
    source.port = port;
    return source;
}

struct Delivered {
    Time at;
    Source source;
    Datagram clear;
    bool operator==(const Delivered&) const = default;
};

/// A gate, and what came through it.
struct Gate {
    explicit Gate(const GateOptions& options) : gate(options) {}

    std::optional<protocol::WireError> offer(const Datagram& datagram,
                                             const Source& source = source_at(1)) {
        now += 1ms;
        return gate.offer(now, source, datagram, take);
    }
    void offer_all(const std::vector<Datagram>& datagrams, const Source& source = source_at(1)) {
        for (const Datagram& datagram : datagrams) REQUIRE(offer(datagram, source) == std::nullopt);
    }
    void work_all() {
        while (gate.work(take)) continue;
    }
    [[nodiscard]] std::uint64_t refused(Refusal why) const {
        return gate.refused()[static_cast<std::size_t>(why)];
    }
    [[nodiscard]] std::uint64_t refused_in_all() const {
        std::uint64_t sum = 0;
        for (const std::uint64_t count : gate.refused()) sum += count;
        return sum;
    }

    DatagramGate gate;
    std::vector<Delivered> delivered;
    Time now = 1s;
    DatagramGate::Deliver take = [this](Time at, const Source& source,
                                        std::span<const std::uint8_t> clear) {
        delivered.push_back({at, source, {clear.begin(), clear.end()}});
    };
};

std::vector<Datagram> clear_forms(const std::vector<Delivered>& delivered) {
    std::vector<Datagram> out;
    out.reserve(delivered.size());
    for (const Delivered& one : delivered) out.push_back(one.clear);
    return out;
}

}  // namespace

TEST_CASE("with the right keys everything comes through, in order and as it was") {
    const auto [sealed, is_signed] =
        GENERATE(std::pair{true, false}, std::pair{false, true}, std::pair{true, true});
    const auto made = keys(sealed, is_signed);
    Gate gate(gate_for(made));
    gate.offer_all(secured(made));
    gate.work_all();
    CHECK(clear_forms(gate.delivered) == clear_datagrams());
    CHECK(gate.refused_in_all() == 0);
    CHECK(gate.gate.admitted() == clear_datagrams().size());
    const Authenticity& said = gate.delivered.front().source.authenticity;
    CHECK(said.sealed == sealed);
    CHECK(said.is_signed == is_signed);
    CHECK(said.verified() == is_signed);
    if (is_signed) CHECK(said.key == made.sign->public_key());
    CHECK(gate.delivered.front().source.address == source_at(1).address);
}

TEST_CASE("no bit of a signed or sealed datagram can change") {
    const auto [sealed, is_signed] =
        GENERATE(std::pair{true, false}, std::pair{false, true}, std::pair{true, true});
    const auto made = keys(sealed, is_signed);
    Gate gate(gate_for(made));
    const Datagram right = secured(made).back();
    std::uint64_t malformed = 0;
    for (std::size_t bit = 0; bit < 8 * right.size(); ++bit) {
        Datagram wrong = right;
        wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ 1 << bit % 8);
        malformed += gate.offer(wrong) ? 1 : 0;
        gate.work_all();
    }
    CHECK(gate.delivered.empty());
    CHECK(malformed >= 8);  // of RTP, version and flags
    CHECK(malformed + gate.refused_in_all() == 8 * right.size());
    CHECK(gate.gate.unverified_dropped() == 0);
}

TEST_CASE("a datagram that is cut or longer does not come through") {
    const auto made = keys(true, true);
    Gate gate(gate_for(made));
    const Datagram right = secured(made).front();
    for (std::size_t size = 0; size < right.size(); ++size) {
        Datagram cut(right.begin(), right.begin() + static_cast<std::ptrdiff_t>(size));
        (void)gate.offer(cut);
    }
    Datagram longer = right;
    longer.push_back(0);
    (void)gate.offer(longer);
    gate.work_all();
    CHECK(gate.delivered.empty());
}

TEST_CASE("each lack of a key is counted under its name") {
    const auto count = [](const GateOptions& options, const sender::StreamKeys& made, Refusal why) {
        Gate gate(options);
        const auto datagrams = made.protection().any() ? secured(made) : clear_datagrams();
        gate.offer_all(datagrams);
        gate.work_all();
        CHECK(gate.delivered.empty());
        CAPTURE(to_string(why));
        CHECK(gate.refused(why) == datagrams.size());
        CHECK(gate.refused_in_all() == datagrams.size());
    };
    count({}, keys(true, false), Refusal::no_key);
    count({}, keys(true, true), Refusal::no_key);
    count(gate_for(keys(true, false)), {}, Refusal::not_sealed);
    count(gate_for(keys(true, true)), keys(false, true), Refusal::not_sealed);
    count(gate_for(keys(false, true)), {}, Refusal::not_signed);
    count(gate_for(keys(true, true)), keys(true, false), Refusal::not_signed);
    count(gate_for(keys(false, true, 2)), keys(false, true), Refusal::unknown_key);
    count(gate_for(keys(true, false, 2)), keys(true, false), Refusal::bad_tag);
}

TEST_CASE("the id of a key does not make a signature of it") {
    auto forged = secured(keys(false, true, 2));
    const auto id = common::key_id(keys(false, true, 1).sign->public_key());
    for (Datagram& datagram : forged) std::copy(id.begin(), id.end(), datagram.begin() + 105);
    Gate gate(gate_for(keys(false, true, 1)));
    gate.offer_all(forged);
    gate.work_all();
    CHECK(gate.delivered.empty());
    CHECK(gate.refused(Refusal::bad_signature) == forged.size());
}

TEST_CASE("of another payload type than was agreed upon nothing comes through") {
    const auto [sealed, is_signed] =
        GENERATE(std::pair{false, false}, std::pair{true, false}, std::pair{false, true});
    const auto made = keys(sealed, is_signed);
    const std::vector<Datagram> datagrams = sealed || is_signed ? secured(made) : clear_datagrams();
    GateOptions options = gate_for(made);
    options.payload_type = 97;  // they are of type 96
    Gate gate(options);
    gate.offer_all(datagrams);
    gate.work_all();
    CHECK(gate.delivered.empty());
    CHECK(gate.refused(Refusal::other_payload_type) == datagrams.size());
    for (const Datagram& datagram : datagrams) CHECK_FALSE(gate.gate.stands_open_for(datagram));
    CHECK(gate.offer({1, 2, 3}).has_value());
    CHECK_FALSE(gate.gate.stands_open_for(Datagram{}));

    options.payload_type = 96;
    Gate right(options);
    if (!sealed && !is_signed) {
        for (const Datagram& datagram : datagrams) CHECK(right.gate.stands_open_for(datagram));
        return;
    }
    right.offer_all(datagrams);
    right.work_all();
    CHECK(right.delivered.size() == datagrams.size());
}

TEST_CASE("junk is told as junk, keys or not") {
    Gate gate(gate_for(keys(true, true)));
    CHECK(gate.offer({}) == protocol::WireError::too_short);
    CHECK(gate.offer(Datagram(200, 0)) == protocol::WireError::not_rtp);
    Datagram damaged = clear_datagrams().front();
    damaged[100] ^= 1;
    CHECK(gate.offer(damaged) == protocol::WireError::bad_checksum);
    Datagram flagged = secured(keys(true, true)).front();
    flagged[13] |= 0x80;
    CHECK(gate.offer(flagged) == protocol::WireError::unsupported_flags);
    CHECK(gate.refused_in_all() == 0);
}

TEST_CASE("without keys to verify, signed datagrams come through as what they are: unverified") {
    Gate gate({});
    CHECK(gate.gate.stands_open_for(clear_datagrams().front()));
    const auto datagrams = secured(keys(false, true));
    CHECK_FALSE(gate.gate.stands_open_for(datagrams.front()));
    gate.offer_all(datagrams);
    CHECK(clear_forms(gate.delivered) == clear_datagrams());
    CHECK(gate.delivered.front().source.authenticity.is_signed);
    CHECK_FALSE(gate.delivered.front().source.authenticity.verified());
    CHECK_FALSE(Gate(gate_for(keys(false, true))).gate.stands_open_for(clear_datagrams().front()));
}

TEST_CASE("several keys may be verified, each for itself") {
    GateOptions options = gate_for(keys(false, true, 1));
    options.verify.push_back(keys(false, true, 2).sign->public_key());
    Gate gate(options);
    gate.offer_all(secured(keys(false, true, 2)));
    gate.offer_all(secured(keys(false, true, 1)));
    gate.offer_all(secured(keys(false, true, 3)));
    gate.work_all();
    CHECK(gate.delivered.size() == 2 * clear_datagrams().size());
    CHECK(gate.delivered.front().source.authenticity.key == options.verify[1]);
    CHECK(gate.delivered.back().source.authenticity.key == options.verify[0]);
}

TEST_CASE("what comes through, and in which order, does not depend on the number of threads") {
    const auto made = keys(false, true);
    std::vector<std::pair<Source, Datagram>> mixed;
    common::Random random(4);
    for (int copy = 0; copy < 8; ++copy) {
        for (Datagram datagram : secured(made, kStart + static_cast<std::uint64_t>(copy % 3))) {
            if (random.chance(0.3)) datagram[datagram.size() - 1 - random.below(60)] ^= 4;
            mixed.emplace_back(source_at(static_cast<std::uint8_t>(random.below(3))), datagram);
        }
    }
    common::shuffle(mixed, random);
    const auto outcome = [&](unsigned threads) {
        GateOptions options = gate_for(made);
        options.threads = threads;
        options.refuse_older_sessions = true;
        Gate gate(options);
        for (std::size_t k = 0; k < mixed.size(); ++k) {
            (void)gate.offer(mixed[k].second, mixed[k].first);
            if (k % 50 == 49) (void)gate.gate.work(gate.take);
        }
        gate.work_all();
        return std::pair(gate.delivered, gate.gate.refused());
    };
    const auto alone = outcome(1);
    CHECK(alone.first.size() > 10);
    CHECK(alone.second[static_cast<std::size_t>(Refusal::bad_signature)] > 10);
    CHECK(alone.second[static_cast<std::size_t>(Refusal::replayed)] > 0);
    CHECK(outcome(2) == alone);
    CHECK(outcome(5) == alone);
    CHECK(std::is_sorted(alone.first.begin(), alone.first.end(),
                         [](const auto& a, const auto& b) { return a.at < b.at; }));
}

TEST_CASE("a full queue drops strangers for those of whom something was verified") {
    const auto made = keys(false, true);
    const auto good = secured(made);
    auto forged = good;
    for (Datagram& datagram : forged) datagram.back() ^= 1;
    GateOptions options = gate_for(made);
    options.queue = 10;
    Gate gate(options);
    REQUIRE(good.size() >= 12);
    const Source known = source_at(1);
    const Source stranger = source_at(2);

    gate.offer_all({good[0]}, known);
    gate.work_all();
    REQUIRE(gate.delivered.size() == 1);

    for (std::size_t k = 0; k < 12; ++k) (void)gate.offer(forged[k], stranger);
    CHECK(gate.gate.waiting() == 10);
    CHECK(gate.gate.unverified_dropped() == 2);
    for (std::size_t k = 1; k < 8; ++k) (void)gate.offer(good[k], known);
    CHECK(gate.gate.waiting() == 10);
    CHECK(gate.gate.unverified_dropped() == 9);
    gate.work_all();
    CHECK(gate.delivered.size() == 8);
    CHECK(gate.refused(Refusal::bad_signature) == 3);

    // Among equals the queue is first come, first served.
    for (std::size_t k = 0; k < 12; ++k) (void)gate.offer(good[k], known);
    CHECK(gate.gate.waiting() == 10);
    CHECK(gate.gate.unverified_dropped() == 11);
}

TEST_CASE("verified sources are served first") {
    const auto made = keys(false, true);
    const auto good = secured(made);
    Gate gate(gate_for(made));
    gate.offer_all({good[0]}, source_at(1));
    gate.work_all();
    gate.offer_all({good[1], good[2]}, source_at(2));
    gate.offer_all({good[3], good[4]}, source_at(1));
    gate.work_all();
    CHECK(clear_forms(gate.delivered) ==
          std::vector<Datagram>{clear_datagrams()[0], clear_datagrams()[3], clear_datagrams()[4],
                                clear_datagrams()[1], clear_datagrams()[2]});
    // Another port, or another session from there, is another sender.
    gate.offer_all({good[1]}, source_at(1, 4001));
    gate.offer_all({good[2]}, source_at(2));
    gate.work_all();
    CHECK(gate.delivered[5].clear == clear_datagrams()[2]);
}

TEST_CASE("the queue is bounded in bytes as well") {
    const auto made = keys(true, true);
    const auto good = secured(made);
    GateOptions options = gate_for(made);
    options.queue_bytes = 7200;
    Gate gate(options);
    gate.offer_all(good);
    CHECK(gate.gate.waiting() >= 3);
    CHECK(gate.gate.waiting() <= 4);
    CHECK(gate.gate.waiting() + gate.gate.unverified_dropped() == good.size());
    gate.work_all();
    gate.offer_all({good.back()});  // there is room again
    CHECK(gate.gate.waiting() == 1);
}

TEST_CASE("a batch is bounded") {
    const auto made = keys(false, true);
    Gate gate(gate_for(made));
    while (gate.gate.waiting() <= DatagramGate::kBatch) gate.offer_all(secured(made));
    const std::size_t waiting = gate.gate.waiting();
    CHECK(gate.gate.work(gate.take));
    CHECK(gate.gate.waiting() == waiting - DatagramGate::kBatch);
    CHECK(gate.delivered.size() == DatagramGate::kBatch);
}

TEST_CASE("an older session of a key is refused, whatever the clock says, once a newer was heard") {
    const bool sealed = GENERATE(false, true);
    const auto made = keys(sealed, !sealed);
    GateOptions options = gate_for(made);
    options.refuse_older_sessions = true;
    Gate gate(options);
    gate.offer_all(secured(made, kStart));
    gate.work_all();
    const std::size_t round = clear_datagrams().size();
    CHECK(gate.delivered.size() == round);
    CHECK(gate.gate.starts().changes() == 0 + gate.gate.starts().size());
    gate.offer_all(secured(made, kStart + 1));
    gate.offer_all(secured(made, kStart));
    gate.offer_all(secured(made, kStart + 1));
    gate.work_all();
    CHECK(gate.delivered.size() == 3 * round);
    CHECK(gate.refused(Refusal::replayed) == round);

    // And so it is for the next run that knows.
    options.starts = gate.gate.starts();
    Gate next(options);
    next.offer_all(secured(made, kStart));
    next.work_all();
    CHECK(next.delivered.empty());
    CHECK(next.refused(Refusal::replayed) == round);
    next.offer_all(secured(made, kStart + 1));
    next.work_all();
    CHECK(next.delivered.size() == round);
}

TEST_CASE("a session that nobody signed does not make others old") {
    const auto made = keys(false, true);
    GateOptions options = gate_for(made);
    options.refuse_older_sessions = true;
    Gate gate(options);
    auto forged = secured(made, kStart + 1000);
    for (Datagram& datagram : forged) datagram.back() ^= 1;
    gate.offer_all(forged);
    gate.work_all();
    gate.offer_all(secured(made, kStart));
    gate.work_all();
    CHECK(gate.delivered.size() == clear_datagrams().size());
    // Without a key to verify it is never looked at.
    Gate unverifying({});
    unverifying.offer_all(secured(made));
    CHECK(unverifying.gate.starts().size() == 0);
}

TEST_CASE("what was sent too long ago, or ahead, is refused by the clock where it is asked for") {
    const auto made = keys(false, true);
    GateOptions options = gate_for(made);
    options.max_age = 10s;
    Gate gate(options);
    const auto at = [&](std::int64_t seconds_after_start) {
        gate.gate.set_clock(gate.now, std::chrono::microseconds(kStart) +
                                          std::chrono::seconds(seconds_after_start));
        const std::size_t before = gate.delivered.size();
        gate.offer_all({secured(made, kStart, 5'000'000).front()});
        gate.work_all();
        return gate.delivered.size() > before;
    };
    CHECK(at(5));
    CHECK(at(14));
    CHECK_FALSE(at(16));
    CHECK_FALSE(at(-6));
    CHECK(at(-4));
    CHECK_FALSE(at(-1'700'000'001));  // a clock before 1970
    CHECK(gate.refused(Refusal::out_of_date) == 3);

    Gate unasked(gate_for(made));
    unasked.gate.set_clock(unasked.now, 0us);
    unasked.offer_all({secured(made).front()});
    unasked.work_all();
    CHECK(unasked.delivered.size() == 1);
}
