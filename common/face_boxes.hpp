// common/face_boxes.hpp
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// A tree of bounding boxes over the faces of a mesh, for finding which might meet. Built in linear
/// time (faces along a Morton curve, halved again and again), and renewed in linear time when
/// vertices move. Answers hold for closed boxes, rounded outwards to float: none that meets is left
/// out. Memory: 50 bytes a face. Same mesh, same answers in the same order.
class FaceBoxes {
  public:
    /// Requires finite positions and fewer than 2^32 - 1 faces.
    explicit FaceBoxes(const TriangleMesh& mesh);

    /// Positions have changed, faces have not.
    void refit(const TriangleMesh& mesh);

    /// Calls visit(g) for each face g != f whose box meets that of f and that comes after f along
    /// the curve, or also for those before it: every pair is found from one of its two faces, or
    /// from both.
    template <class Visit>
    void for_each_later(std::uint32_t f, const Visit& visit) const {
        for_each_from(slot_of_face_[f] + 1, slot_of_face_[f], visit);
    }
    template <class Visit>
    void for_each_meeting(std::uint32_t f, const Visit& visit) const {
        for_each_from(0, slot_of_face_[f], visit);
    }
    /// Calls visit(f) for the faces at places [begin, end) along the curve.
    template <class Visit>
    void for_each_slot(std::size_t begin, std::size_t end, const Visit& visit) const {
        for (std::size_t slot = begin; slot < end; ++slot) visit(face_of_slot_[slot]);
    }

  private:
    struct Box {
        std::array<float, 3> low, high;

        [[nodiscard]] bool meets(const Box& o) const {
            // No short cuts: six comparisons cost less than a wrong guess.
            int apart = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                apart |=
                    static_cast<int>(low[k] > o.high[k]) | static_cast<int>(o.low[k] > high[k]);
            }
            return apart == 0;
        }
    };
    static constexpr std::size_t kLeafFaces = 4;

    static Box empty_box();
    static Box box_of(const TriangleMesh& mesh, std::uint32_t f);
    static Box joined(const Box& a, const Box& b);

    /// Faces in slots `from` and on, other than `own`, whose boxes meet that of `own`.
    template <class Visit>
    void for_each_from(std::size_t from, std::size_t own, const Visit& visit) const;

    std::vector<std::uint32_t> face_of_slot_;  // along the curve
    std::vector<std::uint32_t> slot_of_face_;
    std::vector<Box> boxes_;  // by slot
    std::vector<Box> nodes_;  // heap: the root is 1, the children of n are 2n and 2n + 1
    std::size_t leaves_ = 0;  // a power of two; leaf n stands for slots from (n - leaves_) * 4
};

template <class Visit>
void FaceBoxes::for_each_from(std::size_t from, std::size_t own, const Visit& visit) const {
    const Box& box = boxes_[own];
    std::array<std::size_t, 64> stack;
    std::size_t waiting = 0;
    stack[waiting++] = 1;
    while (waiting > 0) {
        const std::size_t node = stack[--waiting];
        // One past the last slot below this node.
        const std::size_t width = leaves_ / std::bit_floor(node);
        const std::size_t end = (node - std::bit_floor(node) + 1) * width * kLeafFaces;
        if (end <= from || !box.meets(nodes_[node])) continue;
        if (node < leaves_) {
            stack[waiting++] = 2 * node + 1;
            stack[waiting++] = 2 * node;
            continue;
        }
        for (std::size_t slot = end - kLeafFaces; slot < end && slot < boxes_.size(); ++slot) {
            if (slot < from || slot == own || !box.meets(boxes_[slot])) continue;
            visit(face_of_slot_[slot]);
        }
    }
}

}  // namespace ellicast::common
