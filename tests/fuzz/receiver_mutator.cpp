// tests/fuzz/receiver_mutator.cpp: mutations that know what a script is, for libFuzzer alone.
#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "common/random.hpp"
#include "protocol/datagram.hpp"
#include "tests/fuzz/receiver_script.hpp"

// Weak: the replay of the corpus has no libFuzzer, and mutates nothing.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size)
    __attribute__((weak));

namespace {

using ellicast::common::Random;
using ellicast::tests::ReceiverScript;
using ellicast::tests::ScriptStep;

// Where header and first section have numbers (WIRE_FORMAT.md): offset and width.
constexpr std::array<std::pair<std::size_t, std::size_t>, 21> kFields{{
    {2, 2},  {4, 4},  {8, 4},  {13, 1}, {14, 8}, {22, 8}, {30, 4},
    {42, 4}, {54, 4}, {58, 4}, {62, 4}, {66, 2}, {68, 4}, {72, 1},
    {73, 4}, {77, 4}, {81, 4}, {85, 4}, {90, 2}, {92, 2}, {94, 4},
}};

void set_number(std::vector<std::uint8_t>& bytes, Random& random) {
    constexpr std::array<std::uint64_t, 12> kNumbers{
        0, 1, 2, 3, 8, 255, 0x7fff, 0xffff, 0x7fffffff, 0x80000000u, 0xffffffff, 0x3f800000};
    const auto [offset, width] = kFields[random.below(kFields.size())];
    const std::uint64_t value =
        random.chance(0.5) ? kNumbers[random.below(kNumbers.size())] : random.next();
    for (std::size_t k = 0; k < width && offset + k < bytes.size(); ++k) {
        bytes[offset + k] = static_cast<std::uint8_t>(value >> (8 * (width - 1 - k)));
    }
}

void mutate_datagram(std::vector<std::uint8_t>& bytes, Random& random) {
    if (random.chance(0.5)) {
        set_number(bytes, random);
        return;
    }
    const std::size_t room = std::min<std::size_t>(bytes.size() + 64, 2000);
    std::vector<std::uint8_t> larger = bytes;
    larger.resize(std::max(room, bytes.size()) + 1);
    const std::size_t size = LLVMFuzzerMutate(larger.data(), bytes.size(), larger.size());
    larger.resize(size);
    bytes = std::move(larger);
}

// A step gets another's sender, object and hint, so that they belong together.
void adopt_header(ScriptStep& step, const ScriptStep& other) {
    constexpr std::size_t kFrom = 14;
    const std::size_t to = ellicast::protocol::kHeaderBytes - 16;
    if (step.datagram.size() < to || other.datagram.size() < to) return;
    std::copy(other.datagram.begin() + kFrom,
              other.datagram.begin() + static_cast<std::ptrdiff_t>(to),
              step.datagram.begin() + kFrom);
}

void mutate_script(ReceiverScript& script, Random& random) {
    auto& steps = script.steps;
    if (steps.empty() || random.chance(0.05)) {
        script.set_up = static_cast<std::uint8_t>(random.next());
        if (steps.empty()) steps.emplace_back();
        return;
    }
    const std::size_t at = random.below(steps.size());
    const std::size_t other = random.below(steps.size());
    const auto place = steps.begin() + static_cast<std::ptrdiff_t>(at);
    switch (random.below(7)) {
        case 0:
            place->control = static_cast<std::uint8_t>(random.next());
            break;
        case 1:
            if (steps.size() < 64) steps.insert(place, ScriptStep(steps[other]));
            break;
        case 2:
            if (steps.size() > 1) steps.erase(place);
            break;
        case 3:
            std::swap(steps[at], steps[other]);
            break;
        case 4:
            adopt_header(*place, steps[other]);
            break;
        default:
            place->control |= ellicast::tests::kFixChecksum;
            mutate_datagram(place->datagram, random);
            break;
    }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned int seed) {
    Random random(seed);
    if (random.chance(0.1)) return LLVMFuzzerMutate(data, size, max_size);
    ReceiverScript script = ellicast::tests::decode_script({data, size});
    for (std::size_t n = 1 + random.below(3); n > 0; --n) mutate_script(script, random);
    std::vector<std::uint8_t> bytes = ellicast::tests::encode_script(script);
    bytes.resize(std::min(bytes.size(), max_size));
    std::memcpy(data, bytes.data(), bytes.size());
    return bytes.size();
}
