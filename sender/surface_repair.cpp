// sender/surface_repair.cpp
#include "sender/surface_repair.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "sender/edge_pairing.hpp"

namespace ellicast::sender {
namespace {

using common::Triangle;
using common::TriangleMesh;
using Eigen::Vector3d;

class Repairer {
  public:
    explicit Repairer(TriangleMesh& mesh)
        : positions_(mesh.positions),
          triangles_(mesh.triangles),
          mate_(3 * mesh.triangles.size(), kNone) {}

    SurfaceRepair run() {
        find_mates();
        orient_patches();
        for (const std::vector<HalfEdge>& edge : crowded_) {
            for (const auto& [a, b] : pair_around_edge(positions_, triangles_, edge)) join(a, b);
        }
        split_vertices();
        fill_holes();
        if (report_.non_manifold_edges > 0 || report_.cut_edges > 0) split_double_edges();
        return report_;
    }

  private:
    void join(HalfEdge a, HalfEdge b) {
        mate_[a] = b;
        mate_[b] = a;
    }

    void find_mates() {
        for_each_edge(triangles_, positions_.size(), [&](std::span<const HalfEdge> edge) {
            if (edge.size() == 2) join(edge[0], edge[1]);
            if (edge.size() > 2) crowded_.emplace_back(edge.begin(), edge.end());
        });
        report_.non_manifold_edges = crowded_.size();
    }

    // Breadth first from the lowest triangle of each patch, across edges of two triangles.
    void orient_patches() {
        constexpr char kUnseen = 2;
        std::vector<char> turned(triangles_.size(), kUnseen);
        std::vector<std::uint32_t> patch;
        for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
            if (turned[seed] != kUnseen) continue;
            patch.assign(1, seed);
            turned[seed] = 0;
            std::size_t turns = 0;
            for (std::size_t i = 0; i < patch.size(); ++i) {
                for (HalfEdge h = 3 * patch[i]; h < 3 * patch[i] + 3; ++h) {
                    if (mate_[h] == kNone) continue;
                    const std::uint32_t other = triangle_of(mate_[h]);
                    const bool opposite = origin(triangles_, h) == target(triangles_, mate_[h]);
                    const char wanted = static_cast<char>(turned[patch[i]] ^ (opposite ? 0 : 1));
                    if (turned[other] == kUnseen) {
                        turned[other] = wanted;
                        turns += static_cast<std::size_t>(wanted);
                        patch.push_back(other);
                    } else if (turned[other] != wanted) {
                        cut(h);
                    }
                }
            }
            if (2 * turns > patch.size()) {
                for (const std::uint32_t t : patch) turned[t] = static_cast<char>(1 - turned[t]);
            }
        }
        turn(turned);
    }

    void cut(HalfEdge h) {
        mate_[mate_[h]] = kNone;
        mate_[h] = kNone;
        ++report_.cut_edges;
    }

    // Swapping corners 1 and 2 turns half-edges 0, 1, 2 into 2, 1, 0 reversed.
    void turn(const std::vector<char>& turned) {
        const auto renamed = [&](HalfEdge h) {
            return h == kNone || turned[triangle_of(h)] == 0 ? h : 3 * triangle_of(h) + 2 - h % 3;
        };
        for (HalfEdge& h : mate_) h = renamed(h);
        for (std::vector<HalfEdge>& edge : crowded_) {
            for (HalfEdge& h : edge) h = renamed(h);
        }
        for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
            if (turned[t] == 0) continue;
            std::swap(triangles_[t][1], triangles_[t][2]);
            std::swap(mate_[3 * t], mate_[3 * t + 2]);
            ++report_.turned_triangles;
        }
    }

    // Corners that joined edges connect share a vertex; every other group about it gets a copy.
    void split_vertices() {
        DisjointSets fans(mate_.size());
        for (HalfEdge h = 0; h < mate_.size(); ++h) {
            if (mate_[h] == kNone || mate_[h] < h) continue;
            assert(origin(triangles_, h) == target(triangles_, mate_[h]));
            fans.join(h, next_in_triangle(mate_[h]));
            fans.join(next_in_triangle(h), mate_[h]);
        }
        std::vector<bool> taken(positions_.size());
        std::vector<bool> split(positions_.size());
        for (HalfEdge corner = 0; corner < mate_.size(); ++corner) {
            std::uint32_t& vertex = triangles_[corner / 3][corner % 3];
            const HalfEdge lowest = fans.find(corner);  // of the fan, so it has its vertex by now
            if (lowest != corner) {
                vertex = triangles_[lowest / 3][lowest % 3];
            } else if (!taken[vertex]) {
                taken[vertex] = true;
            } else {
                split[vertex] = true;
                const Vector3d position = positions_[vertex];
                vertex = static_cast<std::uint32_t>(positions_.size());
                positions_.push_back(position);
            }
        }
        report_.split_vertices =
            static_cast<std::size_t>(std::count(split.begin(), split.end(), true));
    }

    // By now a vertex lies on at most one loop, once.
    void fill_holes() {
        std::vector<HalfEdge> leaving(positions_.size(), kNone);
        const auto half_edges = static_cast<HalfEdge>(mate_.size());
        for (HalfEdge h = 0; h < half_edges; ++h) {
            if (mate_[h] == kNone) leaving[origin(triangles_, h)] = h;
        }
        std::vector<HalfEdge> loop;
        for (HalfEdge h = 0; h < half_edges; ++h) {
            if (mate_[h] != kNone) continue;
            loop.clear();
            HalfEdge at = h;
            do {
                loop.push_back(at);
                at = leaving[target(triangles_, at)];
                assert(at != kNone);
            } while (at != h);
            close_loop(loop);
        }
    }

    void close_loop(const std::vector<HalfEdge>& loop) {
        if (loop.size() == 2) return join(loop[0], loop[1]);
        ++report_.holes;
        if (loop.size() == 3) {
            const HalfEdge first =
                add_triangle(origin(triangles_, loop[0]), origin(triangles_, loop[2]),
                             origin(triangles_, loop[1]));
            for (HalfEdge i = 0; i < 3; ++i) join(loop[2 - i], first + i);
            return;
        }
        const auto center = static_cast<std::uint32_t>(positions_.size());
        positions_.push_back(centroid(loop));
        const auto n = static_cast<HalfEdge>(loop.size());
        const auto base = static_cast<HalfEdge>(mate_.size());
        for (HalfEdge i = 0; i < n; ++i) {
            add_triangle(target(triangles_, loop[i]), origin(triangles_, loop[i]), center);
        }
        for (HalfEdge i = 0; i < n; ++i) {
            join(loop[i], base + 3 * i);
            join(base + 3 * i + 1, base + 3 * ((i + n - 1) % n) + 2);
        }
    }

    // Of the line itself, not of its vertices: dense stretches do not pull it.
    [[nodiscard]] Vector3d centroid(const std::vector<HalfEdge>& loop) const {
        Vector3d sum = Vector3d::Zero();
        double length = 0;
        const Vector3d base = positions_[origin(triangles_, loop[0])];
        for (const HalfEdge h : loop) {
            const Vector3d a = positions_[origin(triangles_, h)] - base;
            const Vector3d b = positions_[target(triangles_, h)] - base;
            sum += (b - a).norm() * 0.5 * (a + b);
            length += (b - a).norm();
        }
        return base + sum / length;
    }

    HalfEdge add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        triangles_.push_back({a, b, c});
        mate_.resize(mate_.size() + 3, kNone);
        return static_cast<HalfEdge>(mate_.size() - 3);
    }

    // A midpoint may itself give a double edge (two triangles with the same three corners): repeat.
    void split_double_edges() {
        for (bool again = true; again;) {
            std::vector<std::uint32_t> midpoint(mate_.size(), kNone);
            again = false;
            for_each_edge(triangles_, positions_.size(), [&](std::span<const HalfEdge> edge) {
                if (edge.size() <= 2) return;
                again = true;
                for (const HalfEdge h : edge) {
                    if (h == edge[0] || h == mate_[edge[0]] || midpoint[h] != kNone) continue;
                    midpoint[h] = midpoint[mate_[h]] =
                        static_cast<std::uint32_t>(positions_.size());
                    positions_.push_back(0.5 * positions_[origin(triangles_, h)] +
                                         0.5 * positions_[target(triangles_, h)]);
                }
            });
            if (again) insert_midpoints(midpoint);
        }
    }

    // Cuts each triangle into a fan over its corners and midpoints, and finds the mates anew: the
    // split edges are unique now, the others keep theirs.
    void insert_midpoints(const std::vector<std::uint32_t>& midpoint) {
        const std::vector<HalfEdge> old_mate = mate_;
        // Where the two ends of an old half-edge went: its only piece, or its first and second
        // half.
        std::vector<std::pair<HalfEdge, HalfEdge>> pieces(old_mate.size());
        const auto old_triangles = static_cast<std::uint32_t>(triangles_.size());
        for (std::uint32_t t = 0; t < old_triangles; ++t) split_triangle(t, midpoint, pieces);
        for (HalfEdge h = 0; h < old_mate.size(); ++h) {
            const auto& [first, second] = pieces[h];
            const auto& [other_first, other_second] = pieces[old_mate[h]];
            join(first, other_second);
            join(second, other_first);
        }
    }

    void split_triangle(std::uint32_t t, const std::vector<std::uint32_t>& midpoint,
                        std::vector<std::pair<HalfEdge, HalfEdge>>& pieces) {
        std::vector<std::uint32_t> ring;  // corners and midpoints in order
        std::vector<HalfEdge> old_edge;   // of which the ring's edge i is a piece
        for (HalfEdge h = 3 * t; h < 3 * t + 3; ++h) {
            pieces[h] = {h, h};
            ring.push_back(origin(triangles_, h));
            old_edge.push_back(h);
            if (midpoint[h] == kNone) continue;
            ring.push_back(midpoint[h]);
            old_edge.push_back(h);
        }
        if (ring.size() == 3) return;
        // The fan's root is a midpoint, so that every new edge has a new end.
        std::size_t root = 0;
        while (old_edge[root] != old_edge[(root + ring.size() - 1) % ring.size()]) ++root;
        std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(root), ring.end());
        std::rotate(old_edge.begin(), old_edge.begin() + static_cast<std::ptrdiff_t>(root),
                    old_edge.end());
        const std::size_t n = ring.size();
        std::vector<HalfEdge> new_edge(n);  // of the ring
        HalfEdge previous_diagonal = kNone;
        for (std::size_t i = 1; i + 1 < n; ++i) {
            HalfEdge first = 3 * t;
            if (i == 1) {
                triangles_[t] = {ring[0], ring[1], ring[2]};
            } else {
                first = add_triangle(ring[0], ring[i], ring[i + 1]);
                join(first, previous_diagonal);
            }
            if (i == 1) new_edge[0] = first;
            new_edge[i] = first + 1;
            if (i + 2 == n) new_edge[n - 1] = first + 2;
            previous_diagonal = first + 2;
        }
        for (HalfEdge h = 3 * t; h < 3 * t + 3; ++h) {
            // In ring order a split edge comes as first half, second half, but the rotation may
            // have put the first half of the root's edge at the very end.
            std::vector<HalfEdge> found;
            for (std::size_t i = 0; i < n; ++i) {
                const std::size_t turned = (i + n - 1) % n;
                if (old_edge[turned] == h) found.push_back(new_edge[turned]);
            }
            pieces[h] = {found.front(), found.back()};
        }
    }

    std::vector<Vector3d>& positions_;
    std::vector<Triangle>& triangles_;
    std::vector<HalfEdge> mate_;                  // the half-edge joined to each, or kNone
    std::vector<std::vector<HalfEdge>> crowded_;  // edges of more than two triangles
    SurfaceRepair report_;
};

}  // namespace

SurfaceRepair make_closed_manifold(TriangleMesh& mesh) {
    return Repairer(mesh).run();
}

}  // namespace ellicast::sender
