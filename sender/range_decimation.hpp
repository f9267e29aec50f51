// sender/range_decimation.hpp: private to sender/surface_decimation.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "sender/collapse_cost.hpp"
#include "sender/decimated_mesh.hpp"
#include "sender/vertex_queue.hpp"

namespace ellicast::sender {

/// What a collapse may do.
enum class Allowed { good_shape, same_topology, anything };

struct Removal {
    std::uint32_t vertex = 0;  // in DecimatedMesh
    float cost = 0;
};

/// Decimates the vertices begin .. end - 1 of a mesh; a vertex with a neighbour outside stays. It
/// looks at nothing but these vertices, the triangles that have all corners among them, and the
/// names of the corners of others, which do not change: so ranges that do not overlap may be
/// decimated at the same time.
class RangeDecimation {
  public:
    /// `keep`: vertices that stay, one value for each of the mesh. It and `mesh` must live as long.
    RangeDecimation(DecimatedMesh& mesh, std::uint32_t begin, std::uint32_t end,
                    const std::vector<bool>* keep = nullptr);

    /// Removes the cheapest vertices, while more than `least` of the range are left, until nothing
    /// more is allowed. Appends what it removes.
    void remove(Allowed allowed, std::uint32_t least, std::vector<Removal>& removals);

  private:
    [[nodiscard]] bool outside(std::uint32_t v) const { return v < begin_ || v >= end_; }
    [[nodiscard]] bool is_marked(std::uint32_t v) const {
        return !outside(v) && marks_[v - begin_] == mark_;
    }
    bool read_star(std::uint32_t v);
    void read_witnesses(std::uint32_t v);
    void evaluate(std::uint32_t v);
    void leave_out(std::uint32_t v);
    [[nodiscard]] bool may_collapse(std::uint32_t v, std::uint32_t u) const;
    [[nodiscard]] bool keeps_topology(std::uint32_t u) const;
    [[nodiscard]] bool keeps_shape(std::uint32_t v, std::uint32_t u) const;
    [[nodiscard]] double plane_cost(std::uint32_t v, std::uint32_t u) const;
    [[nodiscard]] double true_cost(std::uint32_t v, std::uint32_t u);
    bool collapse_first();
    void collapse(std::uint32_t v, std::uint32_t u);
    void move_witnesses(std::uint32_t v, std::uint32_t u);

    DecimatedMesh& mesh_;
    std::uint32_t begin_, end_;
    const std::vector<bool>* keep_;
    Allowed allowed_ = Allowed::good_shape;

    // By v - begin_.
    std::vector<std::uint32_t> target_;  // where a vertex in the queue would go
    std::vector<bool> changed_;          // its neighbourhood, since its cost was computed
    std::vector<std::uint32_t> marks_;   // a vertex has the current mark: it is in ring_
    VertexQueue queue_;
    std::uint32_t mark_ = 0;

    // Of the vertex that was looked at last.
    struct Blade {
        std::uint32_t a, b;  // what the triangle has beside the vertex
        std::uint32_t triangle;
    };
    std::vector<Blade> star_;
    std::vector<std::uint32_t> ring_;
    std::vector<std::uint32_t> touched_;  // the ring of the vertex that was removed last
    std::vector<std::uint32_t> witnesses_;
    std::vector<std::pair<double, std::uint32_t>> candidates_;
    TriangleFan fan_;
};

}  // namespace ellicast::sender
