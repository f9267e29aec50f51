// common/face_boxes.cpp
#include "common/face_boxes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/morton_order.hpp"

namespace ellicast::common {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLargest = std::numeric_limits<float>::max();

// More than what rounding a double to x changed. No branch, which would be guessed wrong half the
// time, and no call: both cost more than boxes that are a little wider.
float last_place(float x) {
    constexpr float kUnit = std::numeric_limits<float>::epsilon();
    constexpr float kLeast = std::numeric_limits<float>::denorm_min();
    return std::max(kUnit * std::abs(x), kLeast);
}

// What is beyond all floats becomes the largest, or infinite.
float rounded_down(double x) {
    const float near = std::min(static_cast<float>(x), kLargest);
    return near - last_place(near);
}

float rounded_up(double x) {
    const float near = std::max(static_cast<float>(x), -kLargest);
    return near + last_place(near);
}

std::vector<Eigen::Vector3d> centers_of(const TriangleMesh& mesh) {
    std::vector<Eigen::Vector3d> centers;
    centers.reserve(mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles) {
        // Thirds first: the sum of large coordinates may overflow.
        centers.push_back(mesh.positions[a] / 3.0 + mesh.positions[b] / 3.0 +
                          mesh.positions[c] / 3.0);
    }
    return centers;
}

}  // namespace

FaceBoxes::Box FaceBoxes::empty_box() {
    return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

FaceBoxes::Box FaceBoxes::box_of(const TriangleMesh& mesh, std::uint32_t f) {
    const auto& [a, b, c] = mesh.triangles[f];
    const Eigen::Vector3d& p = mesh.positions[a];
    const Eigen::Vector3d& q = mesh.positions[b];
    const Eigen::Vector3d& r = mesh.positions[c];
    Box box{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        box.low[k] = rounded_down(std::min({p[axis], q[axis], r[axis]}));
        box.high[k] = rounded_up(std::max({p[axis], q[axis], r[axis]}));
    }
    return box;
}

FaceBoxes::Box FaceBoxes::joined(const Box& a, const Box& b) {
    Box box{};
    for (std::size_t k = 0; k < 3; ++k) {
        box.low[k] = std::min(a.low[k], b.low[k]);
        box.high[k] = std::max(a.high[k], b.high[k]);
    }
    return box;
}

FaceBoxes::FaceBoxes(const TriangleMesh& mesh) : face_of_slot_(morton_order(centers_of(mesh))) {
    const std::size_t count = mesh.triangles.size();
    assert(count < std::numeric_limits<std::uint32_t>::max());
    slot_of_face_.resize(count);
    for (std::size_t slot = 0; slot < count; ++slot) {
        slot_of_face_[face_of_slot_[slot]] = static_cast<std::uint32_t>(slot);
    }
    leaves_ = std::bit_ceil(std::max<std::size_t>(1, (count + kLeafFaces - 1) / kLeafFaces));
    boxes_.resize(count);
    nodes_.resize(2 * leaves_);
    refit(mesh);
}

void FaceBoxes::refit(const TriangleMesh& mesh) {
    assert(mesh.triangles.size() == boxes_.size());
    std::fill(nodes_.begin(), nodes_.end(), empty_box());
    for (std::size_t slot = 0; slot < boxes_.size(); ++slot) {
        boxes_[slot] = box_of(mesh, face_of_slot_[slot]);
        Box& leaf = nodes_[leaves_ + slot / kLeafFaces];
        leaf = joined(leaf, boxes_[slot]);
    }
    for (std::size_t node = leaves_; node-- > 1;) {
        nodes_[node] = joined(nodes_[2 * node], nodes_[2 * node + 1]);
    }
}

}  // namespace ellicast::common
