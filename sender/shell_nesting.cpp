// sender/shell_nesting.cpp
#include "sender/shell_nesting.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace ellicast::sender {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

constexpr std::size_t kMaxTested = 1024;

// The side of p on which the line a -> b of the y-z plane passes: positive when p lies to its left.
// Zero only for a = b in that plane. The line is taken in one direction whoever asks, so that the
// two triangles at an edge agree, and a point on it counts as moved by (e, e^2), so that one of
// them has it.
int side_of_line(const Vector3d& a, const Vector3d& b, const Vector3d& p) {
    if (std::pair(b.y(), b.z()) < std::pair(a.y(), a.z())) return -side_of_line(b, a, p);
    const double dy = b.y() - a.y();
    const double dz = b.z() - a.z();
    const double area = dy * (p.z() - a.z()) - dz * (p.y() - a.y());
    if (area != 0.0) return area > 0.0 ? 1 : -1;
    if (dz != 0.0) return dz < 0.0 ? 1 : -1;
    return dy > 0.0 ? 1 : 0;
}

// What the triangle adds to its part's winding number about p: the ray from p along x leaves (1) or
// enters
// (-1) through it, or misses it (0).
int winding_of(const TriangleMesh& mesh, const Triangle& triangle, const Vector3d& p) {
    const Vector3d& a = mesh.positions[triangle[0]];
    const Vector3d& b = mesh.positions[triangle[1]];
    const Vector3d& c = mesh.positions[triangle[2]];
    const int side = side_of_line(a, b, p);
    if (side == 0 || side_of_line(b, c, p) != side || side_of_line(c, a, p) != side) return 0;
    const Vector3d n = (b - a).cross(c - a);
    if (n.x() == 0.0) return 0;
    const double x = a.x() - (n.y() * (p.y() - a.y()) + n.z() * (p.z() - a.z())) / n.x();
    return x > p.x() ? side : 0;
}

// Triangles by the cells of a square grid over the y-z plane that their boxes meet.
class RayGrid {
  public:
    explicit RayGrid(const TriangleMesh& mesh) : mesh_(mesh) {
        for (const Triangle& t : mesh.triangles) {
            for (const std::uint32_t v : t) box_.extend(flat(mesh.positions[v]));
        }
        // About two triangles a cell; fewer cells where large triangles would lie in too many.
        cells_ = std::clamp(
            static_cast<int>(std::sqrt(static_cast<double>(mesh.triangles.size()) / 2.0)), 1, 1024);
        while (cells_ > 1 && entries() > 8 * mesh.triangles.size() + 1024) cells_ /= 2;
        fill();
    }

    /// Parts other than `own` that wind about p, each with its winding number.
    std::vector<std::pair<std::uint32_t, int>> around(
        const Vector3d& p, std::uint32_t own, const std::vector<std::uint32_t>& part) const {
        const std::array<int, 2> cell = cell_of(flat(p));
        const std::size_t index = index_of(cell[0], cell[1]);
        std::vector<std::pair<std::uint32_t, int>> found;
        for (std::size_t i = first_[index]; i < first_[index + 1]; ++i) {
            const std::uint32_t t = items_[i];
            if (part[t] == own) continue;
            const int winding = winding_of(mesh_, mesh_.triangles[t], p);
            if (winding != 0) found.emplace_back(part[t], winding);
        }
        std::sort(found.begin(), found.end());
        std::vector<std::pair<std::uint32_t, int>> sums;
        for (const auto& [of, winding] : found) {
            if (sums.empty() || sums.back().first != of) sums.emplace_back(of, 0);
            sums.back().second += winding;
        }
        std::erase_if(sums, [](const auto& sum) { return sum.second == 0; });
        return sums;
    }

  private:
    static Eigen::Vector2d flat(const Vector3d& p) { return {p.y(), p.z()}; }

    [[nodiscard]] std::size_t index_of(int i, int j) const {
        return static_cast<std::size_t>(i) +
               static_cast<std::size_t>(cells_) * static_cast<std::size_t>(j);
    }
    [[nodiscard]] std::array<int, 2> cell_of(const Eigen::Vector2d& p) const {
        std::array<int, 2> cell{};
        for (int axis = 0; axis < 2; ++axis) {
            const double size = box_.sizes()[axis];
            const double share = size > 0.0 ? (p[axis] - box_.min()[axis]) / size : 0.0;
            cell[static_cast<std::size_t>(axis)] =
                std::clamp(static_cast<int>(share * cells_), 0, cells_ - 1);
        }
        return cell;
    }
    [[nodiscard]] std::pair<std::array<int, 2>, std::array<int, 2>> cells_of(
        const Triangle& t) const {
        Eigen::AlignedBox2d box;
        for (const std::uint32_t v : t) box.extend(flat(mesh_.positions[v]));
        return {cell_of(box.min()), cell_of(box.max())};
    }
    [[nodiscard]] std::size_t entries() const {
        std::size_t sum = 0;
        for (const Triangle& t : mesh_.triangles) {
            const auto [low, high] = cells_of(t);
            sum += static_cast<std::size_t>(high[0] - low[0] + 1) *
                   static_cast<std::size_t>(high[1] - low[1] + 1);
        }
        return sum;
    }
    template <class Visit>
    void for_each_entry(const Visit& visit) const {
        for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
            const auto [low, high] = cells_of(mesh_.triangles[t]);
            for (int j = low[1]; j <= high[1]; ++j) {
                for (int i = low[0]; i <= high[0]; ++i) visit(index_of(i, j), t);
            }
        }
    }
    void fill() {
        first_.assign(index_of(0, cells_) + 1, 0);
        for_each_entry([&](std::size_t cell, std::uint32_t) { ++first_[cell + 1]; });
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        items_.resize(first_.back());
        std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
        for_each_entry([&](std::size_t cell, std::uint32_t t) { items_[next[cell]++] = t; });
    }

    const TriangleMesh& mesh_;
    Eigen::AlignedBox2d box_;
    int cells_ = 1;
    std::vector<std::size_t> first_;
    std::vector<std::uint32_t> items_;
};

struct Part {
    std::vector<std::uint32_t> triangles;
    double volume = 0;
    std::vector<std::uint32_t> around;  // the parts that enclose it
    int sign = 1;                       // outward or inward, in the end
};

std::vector<Part> collect_parts(const TriangleMesh& mesh,
                                const std::vector<std::uint32_t>& part_of_triangle) {
    std::vector<Part> parts;
    for (std::uint32_t t = 0; t < part_of_triangle.size(); ++t) {
        if (part_of_triangle[t] >= parts.size()) parts.resize(part_of_triangle[t] + std::size_t{1});
        parts[part_of_triangle[t]].triangles.push_back(t);
    }
    for (Part& part : parts) {
        const Vector3d base = mesh.positions[mesh.triangles[part.triangles[0]][0]];
        for (const std::uint32_t t : part.triangles) {
            const auto& [a, b, c] = mesh.triangles[t];
            part.volume += (mesh.positions[a] - base)
                               .dot((mesh.positions[b] - base).cross(mesh.positions[c] - base)) /
                           6.0;
        }
    }
    return parts;
}

// The parts that have most of three triangles' centres of `index` inside.
std::vector<std::uint32_t> enclosing(const TriangleMesh& mesh, const std::vector<Part>& parts,
                                     std::uint32_t index,
                                     const std::vector<std::uint32_t>& part_of_triangle,
                                     const RayGrid& grid) {
    const std::vector<std::uint32_t>& own = parts[index].triangles;
    std::vector<std::uint32_t> votes;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto& [a, b, c] = mesh.triangles[own[k * own.size() / 3]];
        const Vector3d center = (mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3.0;
        for (const auto& [part, winding] : grid.around(center, index, part_of_triangle)) {
            votes.push_back(part);
        }
    }
    std::sort(votes.begin(), votes.end());
    std::vector<std::uint32_t> result;
    for (std::size_t i = 0; i + 1 < votes.size(); ++i) {
        if (votes[i] == votes[i + 1] && (result.empty() || result.back() != votes[i])) {
            result.push_back(votes[i]);
        }
    }
    return result;
}

void find_enclosing(const TriangleMesh& mesh, const std::vector<std::uint32_t>& part_of_triangle,
                    std::vector<Part>& parts) {
    std::vector<std::uint32_t> tested(parts.size());
    std::iota(tested.begin(), tested.end(), 0u);
    std::stable_sort(tested.begin(), tested.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::abs(parts[a].volume) > std::abs(parts[b].volume);
    });
    tested.resize(std::min(tested.size(), kMaxTested));
    const RayGrid grid(mesh);
    for (const std::uint32_t index : tested) {
        parts[index].around = enclosing(mesh, parts, index, part_of_triangle, grid);
    }
}

// From the outside inwards.
void choose_signs(std::vector<Part>& parts) {
    std::vector<std::uint32_t> order(parts.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return parts[a].around.size() < parts[b].around.size();
    });
    for (const std::uint32_t index : order) {
        Part& part = parts[index];
        int winding_around = 0;
        const Part* outermost = nullptr;
        for (const std::uint32_t other : part.around) {
            winding_around += parts[other].sign;
            if (outermost == nullptr || parts[other].around.size() < outermost->around.size()) {
                outermost = &parts[other];
            }
        }
        const bool turned_with = outermost != nullptr && outermost->volume < 0.0;
        const bool inward = part.volume < 0.0;
        part.sign = winding_around != 0 && inward != turned_with ? -1 : 1;
    }
}

}  // namespace

OrientedParts orient_parts(TriangleMesh& mesh, const std::vector<std::uint32_t>& part_of_triangle) {
    std::vector<Part> parts = collect_parts(mesh, part_of_triangle);
    const bool all_outward =
        std::all_of(parts.begin(), parts.end(), [](const Part& part) { return part.volume >= 0; });
    if (parts.size() > 1 && !all_outward) find_enclosing(mesh, part_of_triangle, parts);
    choose_signs(parts);

    OrientedParts result;
    result.parts = parts.size();
    const double diagonal = common::bounding_box(mesh.positions).diagonal().norm();
    for (const Part& part : parts) {
        result.volume += part.sign * std::abs(part.volume);
        if (std::abs(part.volume) <= 1e-15 * diagonal * diagonal * diagonal) ++result.flat;
        if (part.volume == 0.0 || (part.volume < 0.0) == (part.sign < 0)) continue;
        ++result.turned;
        for (const std::uint32_t t : part.triangles) {
            std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
        }
    }
    return result;
}

}  // namespace ellicast::sender
