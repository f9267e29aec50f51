// receiver/missed_shape.cpp
#include "receiver/missed_shape.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ellicast::receiver {
namespace {

// Multiples of the doubt everywhere and of the largest nearby. rms with those of 2 and 4 over rms
// without any of this, of 2.5 and 5 over the same, at 90 % loss with normals: rocker-arm 1.25 and
// 1.00, homer 1.00 and 0.95; at 70 %: spot 0.72 and 0.75.
constexpr double kUsual = 2.5;
constexpr double kNearby = 5.0;

}  // namespace

MissedShape::MissedShape(const common::TriangleMesh& mesh, const std::vector<double>& doubts,
                         const common::TriangleMesh& concealed)
    : mesh_(mesh), doubts_(doubts), between_(mesh), concealed_(concealed) {
    assert(doubts.size() == mesh.positions.size());
    double sum = 0.0;
    std::size_t count = 0;
    for (const double doubt : doubts) {
        if (doubt < 0.0) continue;
        sum += doubt * doubt;
        ++count;
    }
    if (count > 0) usual_doubt_ = std::sqrt(sum / static_cast<double>(count));
}

bool MissedShape::at(const Eigen::Vector3d& point) const {
    double nearby = 0.0;
    for (const std::uint32_t v : mesh_.triangles[between_.closest(point).triangle]) {
        nearby = std::max(nearby, doubts_[v]);
    }
    const double wrong = kUsual * usual_doubt_ + kNearby * nearby;
    return concealed_.closest(point).squared_distance > wrong * wrong;
}

}  // namespace ellicast::receiver
