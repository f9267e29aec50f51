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
        : frame_(frame),
          values_(values),
          isolevel_(isolevel),
          inside_(values.size()),
          spans_(static_cast<std::size_t>(frame.dims[1]) *
                 static_cast<std::size_t>(frame.dims[2])) {}

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

    // Inside nodes of a row lie from `first` to before `last`; none where these are equal.
    struct Span {
        int first = 0;
        int last = 0;
    };

    void classify(std::size_t k_begin, std::size_t k_end) {
        const auto [nx, ny, nz] = frame_.dims;
        for (int k = static_cast<int>(k_begin); k < static_cast<int>(k_end); ++k) {
            if (k == 0 || k == nz - 1) continue;  // border
            for (int j = 1; j + 1 < ny; ++j) classify_row(j, k);
        }
    }

    void classify_row(int j, int k) {
        const std::size_t row = frame_.index(0, j, k);
        const auto end = static_cast<std::size_t>(frame_.dims[0] - 1);
        std::uint8_t any = 0;
        for (std::size_t i = 1; i < end; ++i) {
            const auto inside = static_cast<std::uint8_t>(values_[row + i] < isolevel_);
            inside_[row + i] = inside;
            any |= inside;
        }
        if (any == 0) return;
        const auto begin = inside_.begin() + static_cast<std::ptrdiff_t>(row);
        Span& span = spans_[span_of(j, k)];
        while (begin[span.first] == 0) ++span.first;
        span.last = frame_.dims[0];
        while (begin[span.last - 1] == 0) --span.last;
    }

    [[nodiscard]] std::size_t span_of(int j, int k) const {
        return static_cast<std::size_t>(j) +
               static_cast<std::size_t>(frame_.dims[1]) * static_cast<std::size_t>(k);
    }

    [[nodiscard]] std::size_t step(int axis) const {
        return axis == 0   ? 1
               : axis == 1 ? static_cast<std::size_t>(frame_.dims[0])
                           : static_cast<std::size_t>(frame_.dims[0]) *
                                 static_cast<std::size_t>(frame_.dims[1]);
    }

    // Calls visit(i, j, pattern) for the cubes above a layer that the surface crosses; bit c of the
    // pattern tells whether corner c is inside. Other cubes have no crossing on any edge.
    template <class Visit>
    void for_each_cube(int k, const Visit& visit) const {
        for (int j = 0; j + 1 < frame_.dims[1]; ++j) {
            const std::array<std::size_t, 4> rows = {span_of(j, k), span_of(j + 1, k),
                                                     span_of(j, k + 1), span_of(j + 1, k + 1)};
            Span span{frame_.dims[0], 0};
            std::array<const std::uint8_t*, 4> inside{};
            for (std::size_t r = 0; r < 4; ++r) {
                inside[r] = inside_.data() + step(1) * rows[r];
                const Span& own = spans_[rows[r]];
                if (own.first == own.last) continue;
                span.first = std::min(span.first, own.first);
                span.last = std::max(span.last, own.last);
            }
            unsigned pattern = 0;
            for (int i = span.first - 1; i < span.last; ++i) {
                // What was at the far end is now at the near one.
                pattern = pattern >> 1 & 0x55U;
                for (std::size_t r = 0; r < 4; ++r) {
                    pattern |= static_cast<unsigned>(inside[r][i + 1]) << (2 * r + 1);
                }
                if (pattern != 0 && pattern != 0xffU) visit(i, j, pattern);
            }
        }
    }

    // The edge that leaves corner 0 along an axis.
    static bool crossed(unsigned pattern, int axis) {
        return ((pattern ^ pattern >> (1U << axis)) & 1U) != 0;
    }

    [[nodiscard]] Counts count_layer(int k) const {
        Counts counts;
        if (k + 1 >= frame_.dims[2])
            return counts;  // the far layer is border: no crossing starts there
        for_each_cube(k, [&](int, int, unsigned pattern) {
            for (int axis = 0; axis < 3; ++axis)
                counts.crossings += crossed(pattern, axis) ? 1U : 0U;
            const CubeCase& cube = cube_cases()[pattern];
            counts.centroids += cube.centred_loops.size();
            counts.triangles += cube.triangles.size();
        });
        return counts;
    }

    void number_layer(int k, std::size_t first, LayerIds& ids) const {
        if (k + 1 >= frame_.dims[2]) return;
        auto next = static_cast<std::uint32_t>(first);
        for_each_cube(k, [&](int i, int j, unsigned pattern) {
            for (int axis = 0; axis < 3; ++axis) {
                if (!crossed(pattern, axis)) continue;
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
        for_each_cube(k, [&](int i, int j, unsigned pattern) {
            for (int axis = 0; axis < 3; ++axis) {
                if (crossed(pattern, axis))
                    mesh.positions[next.crossings++] = crossing(i, j, k, axis);
            }
            const CubeCase& cube = cube_cases()[pattern];
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
    std::vector<Span> spans_;  // by row
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
