// sender/vertex_walk.cpp
#include "sender/vertex_walk.hpp"

#include <algorithm>
#include <array>
#include <cassert>

#include "common/random.hpp"

namespace ellicast::sender {
namespace {

/// Numbers for one round that are the same wherever they are asked for.
common::Random random_of(const protocol::ObjectId& id, std::uint32_t round) {
    std::uint64_t seed = round;
    for (const std::uint8_t byte : id) seed = seed * 257 + byte;
    return common::Random(seed);
}

// Of the vertices, in the passes; then again. At twice the vertices a quarter of them was there
// three times and another once.
constexpr std::array<std::uint32_t, 3> kQuarters{4, 3, 1};

// With copies, a stride leaves no class shorter than a datagram even in a pass that holds one
// vertex in so many.
constexpr std::uint32_t kShortestPass = 8;

}  // namespace

VertexWalk::VertexWalk(const WalkSizes& sizes, const protocol::ObjectId& id, std::uint32_t round)
    : sizes_(sizes) {
    const auto& [vertices, positions, most] = sizes_;
    assert(vertices >= 1 && most >= 1 && positions >= vertices);
    if (round == 0) return;
    common::Random random = random_of(id, round);
    // Odd, so that a datagram stays an even sample: spread_order goes by the binary digits of the
    // index, and so does every stratum of an order of importance.
    const bool copies = positions > vertices;
    const std::uint32_t shortest = copies ? vertices / kShortestPass : vertices;
    const std::uint32_t largest = std::max(1u, shortest / most);
    stride_ = 1 + 2 * static_cast<std::uint32_t>(random.below((largest + 1) / 2));
    // At the start of a class: then a datagram meets at most one border between classes. A single
    // class may begin anywhere, but for copies, of which none may meet its original.
    if (stride_ > 1) {
        first_class_ = static_cast<std::uint32_t>(random.below(stride_));
    } else if (!copies) {
        start_ = static_cast<std::uint32_t>(random.below(vertices));
    }
}

std::uint32_t VertexWalk::Pass::class_begin(std::uint32_t j) const {
    return j * (length / stride) + std::min(j, length % stride);
}

std::uint32_t VertexWalk::Pass::class_of(std::uint32_t place) const {
    const std::uint32_t longer = length % stride;  // classes with one vertex more
    const std::uint32_t size = length / stride;
    const std::uint32_t in_longer = longer * (size + 1);
    return place < in_longer ? place / (size + 1) : longer + (place - in_longer) / size;
}

std::uint32_t VertexWalk::pass_length(std::uint32_t pass) const {
    const std::uint64_t quarters = kQuarters[pass % kQuarters.size()];
    return std::max(static_cast<std::uint32_t>(sizes_.vertices * quarters / 4),
                    std::min(sizes_.vertices, sizes_.most));
}

VertexWalk::Pass VertexWalk::pass_at(std::uint32_t position) const {
    Pass pass;
    pass.length = sizes_.vertices;
    for (std::uint32_t k = 1; position - pass.begin >= pass.length; ++k) {
        pass.begin += pass.length;
        pass.length = std::min(pass_length(k), sizes_.positions - pass.begin);
    }
    if (pass.length / stride_ >= sizes_.most) pass.stride = stride_;
    pass.start = pass.stride > 1 ? pass.class_begin(first_class_) : start_;
    return pass;
}

VertexRun VertexWalk::first_run(std::uint32_t begin, std::uint32_t count) const {
    assert(begin <= sizes_.positions && count > 0 && count <= sizes_.positions - begin);
    const Pass pass = pass_at(begin);
    const std::uint32_t within = begin - pass.begin;
    const auto place =
        static_cast<std::uint32_t>((std::uint64_t{within} + pass.start) % pass.length);
    const std::uint32_t j = pass.class_of(place);
    VertexRun run;
    run.first = j + (place - pass.class_begin(j)) * pass.stride;
    run.stride = pass.stride;
    run.count = std::min({count, pass.class_begin(j + 1) - place, pass.length - within});
    return run;
}

}  // namespace ellicast::sender
