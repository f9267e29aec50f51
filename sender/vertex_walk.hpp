// sender/vertex_walk.hpp: private to sender/round_plan.
#pragma once

#include <cstdint>

#include "protocol/datagram.hpp"

namespace ellicast::sender {

/// Vertex indices first, first + stride, ...
struct VertexRun {
    std::uint32_t first = 0;
    std::uint32_t stride = 1;
    std::uint32_t count = 0;
};

/// The numbers a walk depends on.
struct WalkSizes {
    std::uint32_t vertices = 1;
    std::uint32_t positions = 1;  // in the round: vertices and copies
    std::uint32_t most = 1;       // vertices that a datagram holds at most
};

/// Which vertex stands at which position of a round. The first pass holds each vertex once; the
/// passes behind it are the copies of a redundant round, breadth before depth (DESIGN section 7):
/// the first three quarters of the indices, then the first quarter, then all, and so on. Where the
/// round ends within a pass, that pass holds as many of the first indices as there is place for. So
/// with an order of importance any number of copies is well spent.
///
/// In round 0 each pass goes in index order. In later rounds it goes class by class modulo an odd
/// stride, beginning with some class and wrapping around, all passes alike: hence a copy follows at
/// the distance of three quarters of the vertices or more, of one quarter when all come again. (Not
/// so in later rounds where copies are fewer than an eighth of the vertices.)
class VertexWalk {
  public:
    /// A function of its arguments. Requires 1 <= vertices <= positions, most >= 1 (asserted).
    VertexWalk(const WalkSizes& sizes, const protocol::ObjectId& id, std::uint32_t round);

    /// Calls visit(run) for the vertices at positions begin .. begin + count - 1, where count is at
    /// most the smaller of `most` and `vertices`: one run; one more in later rounds, since no class
    /// is shorter than `most`; and one more with copies, since no pass but the last is.
    template <class Visit>
    void for_each_run(std::uint32_t begin, std::uint32_t count, Visit&& visit) const {
        while (count > 0) {
            const VertexRun run = first_run(begin, count);
            visit(run);
            begin += run.count;
            count -= run.count;
        }
    }

  private:
    struct Pass {
        std::uint32_t begin = 0;   // position
        std::uint32_t length = 0;  // it holds the indices 0 .. length - 1
        std::uint32_t stride = 1;
        std::uint32_t start = 0;  // where in its classes it begins

        [[nodiscard]] std::uint32_t class_begin(std::uint32_t j) const;
        [[nodiscard]] std::uint32_t class_of(std::uint32_t place) const;
    };
    /// The longest run from a position on; requires count > 0.
    [[nodiscard]] VertexRun first_run(std::uint32_t begin, std::uint32_t count) const;
    [[nodiscard]] std::uint32_t pass_length(std::uint32_t pass) const;
    [[nodiscard]] Pass pass_at(std::uint32_t position) const;

    WalkSizes sizes_;
    std::uint32_t stride_ = 1;
    std::uint32_t first_class_ = 0;
    std::uint32_t start_ = 0;  // with a single class and no copies
};

}  // namespace ellicast::sender
