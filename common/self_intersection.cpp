// common/self_intersection.cpp
#include "common/self_intersection.hpp"

#include <algorithm>
#include <mutex>

#include "common/parallel.hpp"
#include "common/triangle_intersection.hpp"

namespace ellicast::common {
namespace {

TriangleCorners corners_of(const TriangleMesh& mesh, const Triangle& t) {
    return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
}

bool share_vertex(const Triangle& s, const Triangle& t) {
    return std::any_of(s.begin(), s.end(), [&](std::uint32_t v) {
        return std::find(t.begin(), t.end(), v) != t.end();
    });
}

bool intersect(const TriangleMesh& mesh, std::uint32_t f, std::uint32_t g) {
    const Triangle& s = mesh.triangles[f];
    const Triangle& t = mesh.triangles[g];
    return !share_vertex(s, t) && triangles_meet(corners_of(mesh, s), corners_of(mesh, t));
}

// Sums and unions from several threads: their order does not show.
class Findings {
  public:
    explicit Findings(std::size_t faces) : marked_(faces, 0) {}

    // `pairs` holds two faces each.
    void take(const std::vector<std::uint32_t>& pairs) {
        const std::lock_guard lock(mutex_);
        pairs_ += pairs.size() / 2;
        for (const std::uint32_t f : pairs) marked_[f] = 1;
    }
    [[nodiscard]] SelfIntersections counts() const {
        return {pairs_, static_cast<std::size_t>(
                            std::count(marked_.begin(), marked_.end(), std::uint8_t{1}))};
    }
    [[nodiscard]] std::vector<std::uint32_t> faces() const {
        std::vector<std::uint32_t> result;
        for (std::uint32_t f = 0; f < marked_.size(); ++f) {
            if (marked_[f] != 0) result.push_back(f);
        }
        return result;
    }

  private:
    std::mutex mutex_;
    std::size_t pairs_ = 0;
    std::vector<std::uint8_t> marked_;  // by face
};

// Every pair of the mesh, once.
void find_all(const TriangleMesh& mesh, const FaceBoxes& boxes, unsigned threads,
              Findings& findings) {
    parallel_for(mesh.triangles.size(), threads, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> pairs;
        boxes.for_each_slot(begin, end, [&](std::uint32_t f) {
            boxes.for_each_later(f, [&](std::uint32_t g) {
                if (intersect(mesh, f, g)) pairs.insert(pairs.end(), {f, g});
            });
        });
        findings.take(pairs);
    });
}

}  // namespace

SelfIntersections count_self_intersections(const TriangleMesh& mesh, unsigned threads) {
    Findings findings(mesh.triangles.size());
    find_all(mesh, FaceBoxes(mesh), threads, findings);
    return findings.counts();
}

std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh, unsigned threads) {
    return IntersectionSearch(mesh).faces(threads);
}

std::vector<std::uint32_t> IntersectionSearch::faces(unsigned threads) const {
    Findings findings(mesh_.triangles.size());
    find_all(mesh_, boxes_, threads, findings);
    return findings.faces();
}

std::vector<std::uint32_t> IntersectionSearch::faces_with(std::span<const std::uint32_t> suspects,
                                                          unsigned threads) const {
    Findings findings(mesh_.triangles.size());
    parallel_for(suspects.size(), threads, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> pairs;
        for (const std::uint32_t f : suspects.subspan(begin, end - begin)) {
            boxes_.for_each_meeting(f, [&](std::uint32_t g) {
                if (intersect(mesh_, f, g)) pairs.insert(pairs.end(), {f, g});
            });
        }
        findings.take(pairs);
    });
    return findings.faces();
}

}  // namespace ellicast::common
