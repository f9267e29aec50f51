// receiver/surface_smoothing.cpp
#include "receiver/surface_smoothing.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <numeric>
#include <utility>

#include "common/parallel.hpp"
#include "receiver/edge_flips.hpp"

namespace ellicast::receiver {
namespace {

// How much a first flip may cost, in mean edge lengths, when a second one is to make up for it.
constexpr double kLookAhead = 1.0;

// No region but one has faces at the corners of h's two faces and of the four around them.
bool is_deep(const SurfaceMesh& mesh, const MeshRegions& regions, HalfedgeId h) {
    if (!is_inner(mesh, regions, h)) return false;
    const std::array<HalfedgeId, 4> sides = sides_of(mesh, h);
    return std::all_of(sides.begin(), sides.end(), [&](HalfedgeId side) {
        return regions.inner(SurfaceMesh::face_of(mesh.twin(side)));
    });
}

// Whether two of the vertices that a flip of h and one beside it could join are marked.
bool may_join_marked(const SurfaceMesh& mesh, std::span<const char> marks, HalfedgeId h) {
    int marked = 0;
    const auto count = [&](VertexId v) { marked += marks[v] != 0 ? 1 : 0; };
    count(mesh.from_vertex(h));
    count(mesh.to_vertex(h));
    count(mesh.opposite(h));
    count(mesh.opposite(mesh.twin(h)));
    for (const HalfedgeId side : sides_of(mesh, h)) count(mesh.opposite(mesh.twin(side)));
    return marked >= 2;
}

}  // namespace

SurfaceSmoother::SurfaceSmoother(SurfaceMesh& mesh, unsigned threads)
    : mesh_(mesh),
      threads_(threads),
      regions_(mesh, false, threads),
      gains_(mesh, threads),
      doubtful_(3 * mesh.face_slots()) {}

std::size_t SurfaceSmoother::smooth(const FlipCriterion& criterion, int passes) {
    return sweep_all(criterion, passes, [](HalfedgeId) { return true; });
}

std::size_t SurfaceSmoother::smooth_marked(const FlipCriterion& criterion, int passes) {
    return sweep_all(criterion, passes,
                     [&](HalfedgeId h) { return may_join_marked(mesh_, criterion.marks, h); });
}

template <class IsDoubtful>
std::size_t SurfaceSmoother::sweep_all(const FlipCriterion& criterion, int passes,
                                       const IsDoubtful& is_doubtful) {
    gains_.judge_by(criterion);
    std::size_t flips =
        sweep(passes, is_inner, is_doubtful, [&](HalfedgeId h) { return flip_one(h); });
    if (criterion.pairs) {
        flips += sweep(passes, is_deep, is_doubtful, [&](HalfedgeId h) { return flip_two(h); });
    }
    return flips;
}

// `attempt(h)` flips around h or not, and tells how often; it keeps to what `is_near` allows.
template <class IsNear, class IsDoubtful, class Attempt>
std::size_t SurfaceSmoother::sweep(int passes, const IsNear& is_near, const IsDoubtful& is_doubtful,
                                   const Attempt& attempt) {
    common::parallel_for(doubtful_.size(), threads_, [&](std::size_t begin, std::size_t end) {
        for (auto h = static_cast<HalfedgeId>(begin); h < end; ++h) {
            doubtful_[h] = stands_for_edge(mesh_, h) && is_doubtful(h) ? 1 : 0;
        }
    });
    if (regions_.count() == 1) return sweep_rest(passes, attempt);
    regions_.find_borders(mesh_, threads_);
    std::vector<std::size_t> flips(regions_.count(), 0);
    regions_.for_each(threads_, [&](std::size_t region) {
        flips[region] = sweep_region(region, passes, is_near, attempt);
    });
    return std::accumulate(flips.begin(), flips.end(), sweep_rest(passes, attempt));
}

// Edges that are not near stay doubtful.
template <class IsNear, class Attempt>
std::size_t SurfaceSmoother::sweep_region(std::size_t region, int passes, const IsNear& is_near,
                                          const Attempt& attempt) {
    std::size_t flips = 0;
    for (int pass = 0; pass < passes; ++pass) {
        const std::size_t before = flips;
        for (const FaceId f : regions_.faces(region)) {
            for (unsigned corner = 0; corner < 3; ++corner) {
                const HalfedgeId h = SurfaceMesh::halfedge(f, corner);
                if (!doubtful(h) || !stands_for_edge(mesh_, h)) continue;
                if (!is_near(mesh_, regions_, h)) continue;
                set_doubtful(h, 0);
                flips += attempt(h);
            }
        }
        if (flips == before) break;
    }
    return flips;
}

template <class Attempt>
std::size_t SurfaceSmoother::sweep_rest(int passes, const Attempt& attempt) {
    std::size_t flips = 0;
    char* const all = doubtful_.data();
    const std::size_t count = doubtful_.size();
    for (int pass = 0; pass < passes; ++pass) {
        const std::size_t before = flips;
        for (std::size_t at = 0; at < count; ++at) {
            const void* const next = std::memchr(all + at, 1, count - at);
            if (next == nullptr) break;
            at = static_cast<std::size_t>(static_cast<const char*>(next) - all);
            all[at] = 0;
            const auto h = static_cast<HalfedgeId>(at);
            if (stands_for_edge(mesh_, h)) flips += attempt(h);
        }
        if (flips == before) break;
    }
    return flips;
}

double SurfaceSmoother::least_gain() const {
    return common::kLeastDiagonalGain * gains_.unit();
}

// What a first flip must gain, when a second one is to make up for what it lacks.
double SurfaceSmoother::look_ahead() const {
    return -kLookAhead * gains_.unit();
}

std::size_t SurfaceSmoother::flip_one(HalfedgeId h) {
    const FlipGains::Trial trial = gains_.consider(h, least_gain());
    if (!(trial.gain > least_gain()) || !mesh_.can_flip(h)) return 0;
    gains_.flip(h, trial);
    SurfaceSmoother::mark(h, 1);
    return 1;
}

// Whether flipping h, alone or with one of the edges around it, might gain enough.
bool SurfaceSmoother::may_pay_with_second(HalfedgeId h, const FlipGains::Trial& first) const {
    if (!(first.gain > look_ahead())) return false;
    return first.gain > least_gain() ||
           gains_.best_pair_gain(h, first, least_gain()) > least_gain();
}

// Flips h and then, where that helps, one of the four edges around it; neither when both
// together do not pay. Leads out of the local minima of flip_one: a crease two triangles wide,
// say.
std::size_t SurfaceSmoother::flip_two(HalfedgeId h) {
    const FlipGains::Trial first = gains_.consider(h, look_ahead());
    if (!may_pay_with_second(h, first) || !mesh_.can_flip(h)) return 0;
    gains_.flip(h, first);
    const double missing = least_gain() - first.gain;  // for the second flip to beat
    const auto [second, trial] = best_beside(h, std::max(missing, 0.0));
    if (second == kNone && !(missing < 0.0)) {
        gains_.undo(h, first);
        return 0;
    }
    mark(h, 2);
    if (second == kNone) return 1;
    gains_.flip(second, trial);
    mark(second, 2);
    return 2;
}

// The edge around h whose flip gains most, if more than `gain`; kNone otherwise.
std::pair<HalfedgeId, FlipGains::Trial> SurfaceSmoother::best_beside(HalfedgeId h,
                                                                     double gain) const {
    std::pair<HalfedgeId, FlipGains::Trial> best{kNone, {}};
    for (const HalfedgeId side : sides_of(mesh_, h)) {
        const FlipGains::Trial trial = gains_.consider(side, gain);
        if (trial.gain > gain && mesh_.can_flip(side)) {
            best = {side, trial};
            gain = trial.gain;
        }
    }
    return best;
}

// A flip changes the gain of the edges of its two faces and of their neighbours' edges, and
// that of pairs one face further.
void SurfaceSmoother::mark(HalfedgeId h, int faces) {
    for (const HalfedgeId side : sides_of(mesh_, h)) mark_beyond(side, faces);
}

void SurfaceSmoother::mark_beyond(HalfedgeId side, int faces) {
    const HalfedgeId beyond = mesh_.twin(side);
    set_doubtful(std::min(side, beyond), 1);
    if (faces == 0) return;
    mark_beyond(SurfaceMesh::next(beyond), faces - 1);
    mark_beyond(SurfaceMesh::prev(beyond), faces - 1);
}

// Of an edge where two regions meet both may say that it is doubtful.
bool SurfaceSmoother::doubtful(HalfedgeId h) {
    return std::atomic_ref(doubtful_[h]).load(std::memory_order_relaxed) != 0;
}
void SurfaceSmoother::set_doubtful(HalfedgeId h, char value) {
    std::atomic_ref(doubtful_[h]).store(value, std::memory_order_relaxed);
}

std::size_t flip_to_smooth(SurfaceMesh& mesh, const FlipCriterion& criterion, int passes,
                           unsigned threads) {
    return SurfaceSmoother(mesh, threads).smooth(criterion, passes);
}

}  // namespace ellicast::receiver
