// common/marching_cubes.cpp
#include "common/marching_cubes.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <vector>

#include "common/parallel.hpp"

namespace ellicast::common {
namespace {

// A cube's corner c lies at (c & 1, c >> 1 & 1, c >> 2). Edge 4 a + s runs along axis a from the
// corner whose other two coordinates are the bits of s (lower axis first).
constexpr int kCorners = 8;
constexpr int kEdges = 12;

struct EdgeGeometry {
    int axis;
    int from;  // corner with coordinate 0 on the axis
};

constexpr EdgeGeometry edge_geometry(int edge) {
    const int axis = edge / 4;
    const int s = edge % 4;
    const int low = axis == 0 ? 1 : 0;
    const int high = axis == 2 ? 1 : 2;
    return {axis, ((s & 1) << low) | ((s >> 1) << high)};
}

int edge_between(int a, int b) {
    for (int e = 0; e < kEdges; ++e) {
        const EdgeGeometry g = edge_geometry(e);
        const int to = g.from | (1 << g.axis);
        if ((g.from == a && to == b) || (g.from == b && to == a)) return e;
    }
    assert(false);
    return -1;
}

// Corners of face `face` (axis, side), counter-clockwise seen from outside the cube.
std::array<int, 4> face_corners(int face) {
    const int axis = face / 2;
    const int side = face % 2;
    const int u = 1 << ((axis + 1) % 3);
    const int v = 1 << ((axis + 2) % 3);
    const int base = side << axis;
    if (side == 1) return {base, base | u, base | u | v, base | v};
    return {base, base | v, base | u | v, base | u};
}

bool share_face(int e, int f) {
    for (int face = 0; face < 6; ++face) {
        const std::array<int, 4> c = face_corners(face);
        bool has_e = false;
        bool has_f = false;
        for (std::size_t i = 0; i < 4; ++i) {
            const int edge = edge_between(c[i], c[(i + 1) % 4]);
            has_e |= edge == e;
            has_f |= edge == f;
        }
        if (has_e && has_f) return true;
    }
    return false;
}

// Triangles of one sign pattern. Corners 0..11 name crossed edges, 12 + k the centroid of loop k.
struct CubeCase {
    std::vector<std::array<std::uint8_t, 3>> triangles;
    std::vector<std::vector<std::uint8_t>> centred_loops;  // loops that need a centroid, in order
};

// Directed segments of a pattern: next[e] is the crossing that follows e on its loop. On each face
// every maximal run of inside corners is cut off by a segment of its own: inside corners are
// separated, by the face's signs alone, so the two cubes at a face agree.
std::array<int, kEdges> link_crossings(unsigned pattern) {
    std::array<int, kEdges> next{};
    next.fill(-1);
    for (int face = 0; face < 6; ++face) {
        const std::array<int, 4> c = face_corners(face);
        const auto inside = [&](std::size_t i) { return (pattern >> c[i % 4] & 1U) != 0; };
        for (std::size_t i = 0; i < 4; ++i) {
            if (!inside(i) || inside(i + 3)) continue;  // a run begins at i
            std::size_t j = i;
            while (inside(j + 1) && j < i + 3) ++j;
            const int entry = edge_between(c[(i + 3) % 4], c[i]);
            const int exit = edge_between(c[j % 4], c[(j + 1) % 4]);
            next[static_cast<std::size_t>(entry)] = exit;
        }
    }
    return next;
}

void triangulate_loop(const std::vector<std::uint8_t>& loop, CubeCase& out) {
    const std::size_t n = loop.size();
    const auto fits = [&](std::size_t root) {
        for (std::size_t k = 2; k + 1 < n; ++k) {
            if (share_face(loop[root], loop[(root + k) % n])) return false;
        }
        return true;
    };
    for (std::size_t root = 0; root < n; ++root) {
        if (!fits(root)) continue;
        for (std::size_t k = 1; k + 1 < n; ++k) {
            out.triangles.push_back({loop[root], loop[(root + k) % n], loop[(root + k + 1) % n]});
        }
        return;
    }
    const auto centre = static_cast<std::uint8_t>(kEdges + out.centred_loops.size());
    for (std::size_t k = 0; k < n; ++k) {
        out.triangles.push_back({centre, loop[k], loop[(k + 1) % n]});
    }
    out.centred_loops.push_back(loop);
}

CubeCase make_case(unsigned pattern) {
    CubeCase result;
    std::array<int, kEdges> next = link_crossings(pattern);
    for (std::size_t start = 0; start < kEdges; ++start) {
        std::vector<std::uint8_t> loop;
        for (std::size_t e = start; next[e] >= 0;) {
            loop.push_back(static_cast<std::uint8_t>(e));
            const auto following = static_cast<std::size_t>(next[e]);
            next[e] = -1;
            e = following;
        }
        if (!loop.empty()) triangulate_loop(loop, result);
    }
    return result;
}

const std::array<CubeCase, 256>& cube_cases() {
    static const std::array<CubeCase, 256> cases = [] {
        std::array<CubeCase, 256> all;
        for (unsigned pattern = 0; pattern < 256; ++pattern) all[pattern] = make_case(pattern);
        return all;
    }();
    return cases;
}

// Crossings closer to a node than this share of the edge make needles and degenerate triangles.
constexpr double kEdgeMargin = 0.05;

class Extractor {
  public:
    Extractor(const GridFrame& frame, std::span<const float> values, float isolevel)
        : frame_(frame), values_(values), isolevel_(isolevel), inside_(values.size()) {}

    TriangleMesh run(unsigned threads) {
        const auto layers = static_cast<std::size_t>(frame_.dims[2]);
        parallel_for(layers, threads, [&](std::size_t b, std::size_t e) { classify(b, e); });
        std::vector<Counts> counts(layers + 1);
        parallel_for(layers, threads, [&](std::size_t b, std::size_t e) {
            for (std::size_t k = b; k < e; ++k) counts[k] = count_layer(static_cast<int>(k));
        });
        Counts sum;
        for (Counts& c : counts) {
            const Counts here = c;
            c = sum;
            sum.crossings += here.crossings;
            sum.centroids += here.centroids;
            sum.triangles += here.triangles;
        }
        TriangleMesh mesh;
        mesh.positions.resize(sum.crossings + sum.centroids);
        mesh.triangles.resize(sum.triangles);
        // Centroids are numbered behind all crossings.
        for (Counts& c : counts) c.centroids += sum.crossings;
        parallel_for(layers, threads,
                     [&](std::size_t b, std::size_t e) { fill_layers(b, e, counts, mesh); });
        return mesh;
    }

  private:
    struct Counts {
        std::size_t crossings = 0;
        std::size_t centroids = 0;
        std::size_t triangles = 0;
    };
    // Vertex numbers of the crossings on the three edges that leave a node in positive direction.
    using LayerIds = std::vector<std::array<std::uint32_t, 3>>;

    void classify(std::size_t k_begin, std::size_t k_end) {
        const auto [nx, ny, nz] = frame_.dims;
        for (std::size_t layer = k_begin; layer < k_end; ++layer) {
            const int k = static_cast<int>(layer);
            for (int j = 0; j < ny; ++j) {
                for (int i = 0; i < nx; ++i) {
                    const bool border =
                        i == 0 || j == 0 || k == 0 || i == nx - 1 || j == ny - 1 || k == nz - 1;
                    const std::size_t n = frame_.index(i, j, k);
                    inside_[n] = !border && values_[n] < isolevel_;
                }
            }
        }
    }

    [[nodiscard]] std::size_t step(int axis) const {
        return axis == 0   ? 1
               : axis == 1 ? static_cast<std::size_t>(frame_.dims[0])
                           : static_cast<std::size_t>(frame_.dims[0]) *
                                 static_cast<std::size_t>(frame_.dims[1]);
    }

    [[nodiscard]] unsigned pattern(std::size_t node) const {
        unsigned bits = 0;
        for (int c = 0; c < kCorners; ++c) {
            const std::size_t n =
                node + (c & 1 ? step(0) : 0) + (c & 2 ? step(1) : 0) + (c & 4 ? step(2) : 0);
            bits |= static_cast<unsigned>(inside_[n]) << c;
        }
        return bits;
    }

    // Calls visit(i, j, node) for the nodes of a layer that are not on its far border where the
    // border has no edges anyway.
    template <class Visit>
    void for_each_node(int k, const Visit& visit) const {
        for (int j = 0; j + 1 < frame_.dims[1]; ++j) {
            for (int i = 0; i + 1 < frame_.dims[0]; ++i) visit(i, j, frame_.index(i, j, k));
        }
    }

    [[nodiscard]] bool crossed(std::size_t node, int axis) const {
        return inside_[node] != inside_[node + step(axis)];
    }

    [[nodiscard]] Counts count_layer(int k) const {
        Counts counts;
        if (k + 1 >= frame_.dims[2])
            return counts;  // the far layer is border: no crossing starts there
        for_each_node(k, [&](int, int, std::size_t node) {
            for (int axis = 0; axis < 3; ++axis) counts.crossings += crossed(node, axis) ? 1U : 0U;
            const CubeCase& cube = cube_cases()[pattern(node)];
            counts.centroids += cube.centred_loops.size();
            counts.triangles += cube.triangles.size();
        });
        return counts;
    }

    void number_layer(int k, std::size_t first, LayerIds& ids) const {
        if (k + 1 >= frame_.dims[2]) return;
        auto next = static_cast<std::uint32_t>(first);
        for_each_node(k, [&](int i, int j, std::size_t node) {
            for (int axis = 0; axis < 3; ++axis) {
                if (!crossed(node, axis)) continue;
                ids[static_cast<std::size_t>(i) + step(1) * static_cast<std::size_t>(j)]
                   [static_cast<std::size_t>(axis)] = next++;
            }
        });
    }

    [[nodiscard]] Eigen::Vector3d crossing(int i, int j, int k, int axis) const {
        const std::size_t from = frame_.index(i, j, k);
        const double v0 = values_[from];
        const double v1 = values_[from + step(axis)];
        double t = (double{isolevel_} - v0) / (v1 - v0);
        // Border nodes are outside whatever their value, so the line may not cross at all.
        if (!(t >= 0.0 && t <= 1.0)) t = 0.5;
        Eigen::Vector3d at(i, j, k);
        at[axis] += std::clamp(t, kEdgeMargin, 1.0 - kEdgeMargin);
        return frame_.origin + frame_.spacing * at;
    }

    void fill_layers(std::size_t k_begin, std::size_t k_end, const std::vector<Counts>& counts,
                     TriangleMesh& mesh) const {
        LayerIds here(step(2));
        LayerIds above(step(2));
        number_layer(static_cast<int>(k_begin), counts[k_begin].crossings, here);
        for (std::size_t layer = k_begin; layer < k_end; ++layer) {
            const int k = static_cast<int>(layer);
            if (k + 1 >= frame_.dims[2]) break;
            number_layer(k + 1, counts[layer + 1].crossings, above);
            fill_layer(k, counts[layer], here, above, mesh);
            std::swap(here, above);
        }
    }

    void fill_layer(int k, Counts next, const LayerIds& here, const LayerIds& above,
                    TriangleMesh& mesh) const {
        for_each_node(k, [&](int i, int j, std::size_t node) {
            for (int axis = 0; axis < 3; ++axis) {
                if (crossed(node, axis)) mesh.positions[next.crossings++] = crossing(i, j, k, axis);
            }
            const CubeCase& cube = cube_cases()[pattern(node)];
            if (cube.triangles.empty()) return;
            std::array<std::uint32_t, kEdges + 4> ids{};
            for (int e = 0; e < kEdges; ++e) {
                const EdgeGeometry g = edge_geometry(e);
                const LayerIds& layer = g.from & 4 ? above : here;
                const std::size_t at = static_cast<std::size_t>(i + (g.from & 1)) +
                                       step(1) * static_cast<std::size_t>(j + ((g.from >> 1) & 1));
                ids[static_cast<std::size_t>(e)] = layer[at][static_cast<std::size_t>(g.axis)];
            }
            for (std::size_t loop = 0; loop < cube.centred_loops.size(); ++loop) {
                const auto& edges = cube.centred_loops[loop];
                Eigen::Vector3d sum = Eigen::Vector3d::Zero();
                for (const std::uint8_t e : edges) {
                    const EdgeGeometry g = edge_geometry(e);
                    sum += crossing(i + (g.from & 1), j + ((g.from >> 1) & 1), k + (g.from >> 2),
                                    g.axis);
                }
                mesh.positions[next.centroids] = sum / static_cast<double>(edges.size());
                ids[kEdges + loop] = static_cast<std::uint32_t>(next.centroids++);
            }
            for (const auto& t : cube.triangles) {
                mesh.triangles[next.triangles++] = {ids[t[0]], ids[t[1]], ids[t[2]]};
            }
        });
    }

    const GridFrame& frame_;
    std::span<const float> values_;
    float isolevel_;
    std::vector<std::uint8_t> inside_;
};

}  // namespace

TriangleMesh marching_cubes(const GridFrame& frame, std::span<const float> values, float isolevel,
                            unsigned threads) {
    assert(values.size() == frame.size());
    for (const int dim : frame.dims) {
        if (dim < 3) return {};  // all nodes are border
    }
    return Extractor(frame, values, isolevel).run(threads);
}

}  // namespace ellicast::common
