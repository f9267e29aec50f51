// receiver/vertex_colours.cpp
#include "receiver/vertex_colours.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <utility>

#include "receiver/vertex_neighbours.hpp"

namespace ellicast::receiver {
namespace {

using common::Colour;

constexpr Colour kGrey{128, 128, 128};

/// Integer sums: the same in whatever order.
class Mean {
  public:
    void add(const Colour& colour) {
        for (std::size_t k = 0; k < 3; ++k) sums_[k] += colour[k];
        ++count_;
    }
    [[nodiscard]] bool any() const { return count_ > 0; }
    [[nodiscard]] Colour value() const {
        assert(any());
        Colour colour{};
        for (std::size_t k = 0; k < 3; ++k) {
            colour[k] = static_cast<std::uint8_t>((sums_[k] + count_ / 2) / count_);
        }
        return colour;
    }

  private:
    std::array<std::uint64_t, 3> sums_{};
    std::uint64_t count_ = 0;
};

/// Gives all vertices that received ones can be reached from a colour, one ring after another.
void spread(const common::TriangleMesh& mesh, std::vector<std::uint32_t> ring,
            std::vector<bool>& coloured, std::vector<Colour>& colours) {
    const VertexNeighbours neighbours(mesh);
    std::vector<Mean> means(mesh.positions.size());
    while (!ring.empty()) {
        std::vector<std::uint32_t> next;
        for (const std::uint32_t v : ring) {
            for (const std::uint32_t other : neighbours.of(v)) {
                if (coloured[other]) continue;
                if (!means[other].any()) next.push_back(other);
                means[other].add(colours[v]);
            }
        }
        for (const std::uint32_t v : next) {
            colours[v] = means[v].value();
            coloured[v] = true;
        }
        ring = std::move(next);
    }
}

}  // namespace

std::vector<Colour> vertex_colours(const Reconstruction& reconstruction,
                                   const ReceivedObject& object) {
    if (!object.hint.format.colour) return {};
    const std::vector<std::uint32_t>& index = reconstruction.vertex_index;
    std::vector<Colour> colours(index.size(), kGrey);
    std::vector<bool> coloured(index.size(), false);
    std::vector<std::uint32_t> received;
    Mean all;
    for (std::uint32_t v = 0; v < index.size(); ++v) {
        const auto place =
            std::lower_bound(object.vertex_index.begin(), object.vertex_index.end(), index[v]);
        if (place == object.vertex_index.end() || *place != index[v]) continue;
        const auto k = static_cast<std::size_t>(place - object.vertex_index.begin());
        colours[v] = object.vertices[k].colour;
        coloured[v] = true;
        received.push_back(v);
        all.add(colours[v]);
    }
    if (received.size() == index.size()) return colours;
    if (received.empty()) return colours;
    for (std::size_t v = 0; v < colours.size(); ++v) {
        if (!coloured[v]) colours[v] = all.value();
    }
    spread(reconstruction.mesh, std::move(received), coloured, colours);
    return colours;
}

}  // namespace ellicast::receiver
