// sender/ellipsoid_selection.cpp
#include "sender/ellipsoid_selection.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/parallel.hpp"
#include "sender/ellipsoid_rows.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::GridFrame;

constexpr double kOne =
    1 << 16;  // fixed-point value of w = 1: 5 digits, and rows of 6000 voxels fit

std::vector<EllipsoidRows> prepare_rows(std::span<const Ellipsoid> candidates,
                                        const GridFrame& frame) {
    std::vector<EllipsoidRows> rows;
    rows.reserve(candidates.size());
    for (const Ellipsoid& candidate : candidates) rows.emplace_back(candidate, frame);
    return rows;
}

std::vector<float> smallest_radii(std::span<const Ellipsoid> candidates) {
    std::vector<float> radii;
    radii.reserve(candidates.size());
    for (const Ellipsoid& candidate : candidates) {
        radii.push_back(static_cast<float>(common::semi_axes(candidate)[0]));
    }
    return radii;
}

// What each voxel would gain now, as sums along rows: the gain of nodes begin <= i < end of row (j,
// k) is one subtraction. This is the whole state of the selection.
class GainRows {
  public:
    GainRows(const GridFrame& frame, std::span<const std::uint8_t> solid)
        : frame_(frame),
          solid_(solid),
          stride_(static_cast<std::size_t>(frame.dims[0]) + 1),
          sums_(stride_ * static_cast<std::size_t>(frame.dims[1]) *
                    static_cast<std::size_t>(frame.dims[2]),
                0) {}

    // Sets every voxel's gain from its thickness (empty: all weigh 1).
    void set_weights(const SelectionOptions& options, const std::vector<float>& thickness,
                     unsigned threads);

    [[nodiscard]] std::int64_t gain(const EllipsoidRows& rows) const {
        std::int64_t sum = 0;
        rows.for_each([&](const VoxelRow& row) {
            const std::int32_t* sums = row_sums(row.j, row.k);
            sum += sums[row.end] - sums[row.begin];
        });
        return sum;
    }

    // Multiplies the gains of the solid's voxels inside by p; those outside keep their price.
    void cover(const EllipsoidRows& rows, std::int64_t p_fixed);

  private:
    [[nodiscard]] std::size_t row_start(int j, int k) const {
        return stride_ * (static_cast<std::size_t>(j) +
                          static_cast<std::size_t>(frame_.dims[1]) * static_cast<std::size_t>(k));
    }
    [[nodiscard]] const std::int32_t* row_sums(int j, int k) const {
        return sums_.data() + row_start(j, k);
    }

    const GridFrame& frame_;
    std::span<const std::uint8_t> solid_;
    std::size_t stride_;
    std::vector<std::int32_t> sums_;
};

void GainRows::set_weights(const SelectionOptions& options, const std::vector<float>& thickness,
                           unsigned threads) {
    const auto arrives = static_cast<float>(kOne * (1.0 - options.loss));
    const auto outside = -static_cast<std::int32_t>(std::lround(kOne * options.outside));
    const auto floor = static_cast<float>(options.thinness_floor * options.diagonal);
    const auto reference = static_cast<float>(options.thinness_reference * options.diagonal);
    common::parallel_for(
        static_cast<std::size_t>(frame_.dims[2]), threads,
        [&](std::size_t first, std::size_t last) {
            for (auto k = static_cast<int>(first); k < static_cast<int>(last); ++k) {
                for (int j = 0; j < frame_.dims[1]; ++j) {
                    std::int32_t* sums = sums_.data() + row_start(j, k);
                    const std::size_t at = frame_.index(0, j, k);
                    for (int i = 0; i < frame_.dims[0]; ++i) {
                        const std::size_t v = at + static_cast<std::size_t>(i);
                        std::int32_t weight = outside;
                        if (solid_[v] != 0) {
                            const float w = thickness.empty()
                                                ? 1.0f
                                                : reference / std::max(floor, thickness[v]);
                            weight = static_cast<std::int32_t>(w * arrives);
                        }
                        sums[i + 1] = sums[i] + weight;
                    }
                }
            }
        });
}

void GainRows::cover(const EllipsoidRows& rows, std::int64_t p_fixed) {
    rows.for_each([&](const VoxelRow& row) {
        std::int32_t* sums = sums_.data() + row_start(row.j, row.k);
        const std::uint8_t* inside = solid_.data() + frame_.index(0, row.j, row.k);
        std::int32_t taken = 0;
        std::int32_t before = sums[row.begin];
        for (int i = row.begin; i < row.end; ++i) {
            const std::int32_t gain = sums[i + 1] - before;
            before = sums[i + 1];
            if (inside[i] != 0) {
                taken += gain - static_cast<std::int32_t>((gain * p_fixed) >> 16);
            }
            sums[i + 1] -= taken;
        }
        for (int i = row.end; i < frame_.dims[0]; ++i) sums[i + 1] -= taken;
    });
}

// The largest minimum radius of all candidates over each voxel: how thick the solid is there.
std::vector<float> voxel_thickness(const std::vector<EllipsoidRows>& rows,
                                   const std::vector<float>& radii, const GridFrame& frame,
                                   unsigned threads) {
    std::vector<float> thickness(frame.size(), 0.0f);
    const auto slab = [&](std::size_t first, std::size_t last) {
        for (std::size_t c = 0; c < rows.size(); ++c) {
            const float radius = radii[c];
            rows[c].for_each(static_cast<int>(first), static_cast<int>(last),
                             [&](const VoxelRow& row) {
                                 float* at = thickness.data() + frame.index(0, row.j, row.k);
                                 for (int i = row.begin; i < row.end; ++i) {
                                     at[i] = std::max(at[i], radius);
                                 }
                             });
        }
    };
    common::parallel_for(static_cast<std::size_t>(frame.dims[2]), threads, slab);
    return thickness;
}

struct Entry {
    std::int64_t gain = 0;  // exact when `checked_at` is the present size, else an upper bound
    std::size_t checked_at = 0;
    std::uint32_t candidate = 0;
};

// Max-heap by gain; equal gains in order of index, so that the heap's order is a function of its
// content.
bool lower_priority(const Entry& a, const Entry& b) {
    if (a.gain != b.gain) return a.gain < b.gain;
    return a.candidate > b.candidate;
}

class LazyHeap {
  public:
    explicit LazyHeap(std::vector<Entry> entries) : entries_(std::move(entries)) {
        std::make_heap(entries_.begin(), entries_.end(), lower_priority);
    }
    [[nodiscard]] bool empty() const { return entries_.empty(); }
    [[nodiscard]] const Entry& top() const { return entries_.front(); }
    Entry pop() {
        std::pop_heap(entries_.begin(), entries_.end(), lower_priority);
        const Entry entry = entries_.back();
        entries_.pop_back();
        return entry;
    }
    void push(const Entry& entry) {
        entries_.push_back(entry);
        std::push_heap(entries_.begin(), entries_.end(), lower_priority);
    }

  private:
    std::vector<Entry> entries_;
};

// Takes the best entry out of the heap; gain 0 when nothing gains. Entries that gain within `tie`
// of the best compete by their smallest radius.
Entry take_best(LazyHeap& heap, const GainRows& gains, const std::vector<EllipsoidRows>& rows,
                const std::vector<float>& radii, double tie, std::size_t step) {
    std::vector<Entry> rivals;
    double least = 1.0;  // nothing gained is nothing worth
    while (!heap.empty() && static_cast<double>(heap.top().gain) >= least) {
        Entry entry = heap.pop();
        if (entry.checked_at != step) {
            entry.gain = gains.gain(rows[entry.candidate]);
            entry.checked_at = step;
            heap.push(entry);
            continue;
        }
        if (rivals.empty()) {
            least = std::max(1.0, (1.0 - tie) * static_cast<double>(entry.gain));
        }
        rivals.push_back(entry);
    }
    if (rivals.empty()) return {};
    const auto best =
        std::min_element(rivals.begin(), rivals.end(), [&](const Entry& a, const Entry& b) {
            if (radii[a.candidate] != radii[b.candidate]) {
                return radii[a.candidate] < radii[b.candidate];
            }
            return a.candidate < b.candidate;
        });
    const Entry taken = *best;
    for (const Entry& rival : rivals) {
        if (rival.candidate != taken.candidate) heap.push(rival);
    }
    return taken;
}

void count_voxels(const std::vector<EllipsoidRows>& rows, const GridFrame& frame,
                  std::span<const std::uint8_t> solid, Selection& selection) {
    std::vector<std::uint8_t> covered(frame.size(), 0);
    for (const std::uint32_t candidate : selection.order) {
        rows[candidate].for_each([&](const VoxelRow& row) {
            std::uint8_t* at = covered.data() + frame.index(0, row.j, row.k);
            std::fill(at + row.begin, at + row.end, std::uint8_t{1});
        });
    }
    for (std::size_t v = 0; v < solid.size(); ++v) {
        const bool inside = solid[v] != 0;
        selection.solid += inside ? 1 : 0;
        selection.covered += inside && covered[v] != 0 ? 1 : 0;
        selection.outside += !inside && covered[v] != 0 ? 1 : 0;
    }
}

}  // namespace

Selection select_greedily(std::span<const Ellipsoid> candidates, const GridFrame& frame,
                          std::span<const std::uint8_t> solid, const SelectionOptions& options) {
    assert(solid.size() == frame.size());
    assert(options.loss >= 0.0 && options.loss < 1.0);
    const std::vector<EllipsoidRows> rows = prepare_rows(candidates, frame);
    const std::vector<float> radii = smallest_radii(candidates);

    GainRows gains(frame, solid);
    gains.set_weights(options,
                      options.thinness ? voxel_thickness(rows, radii, frame, options.threads)
                                       : std::vector<float>(),
                      options.threads);

    std::vector<Entry> entries(candidates.size());
    common::parallel_for(
        candidates.size(), options.threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t c = first; c < last; ++c) {
                entries[c] = {gains.gain(rows[c]), 0, static_cast<std::uint32_t>(c)};
            }
        });

    LazyHeap heap(std::move(entries));
    const auto p_fixed = static_cast<std::int64_t>(std::lround(options.loss * kOne));
    Selection selection;
    while (selection.order.size() < options.count) {
        const Entry best = take_best(heap, gains, rows, radii, options.tie, selection.order.size());
        if (best.gain <= 0) break;
        selection.order.push_back(best.candidate);
        gains.cover(rows[best.candidate], p_fixed);
    }
    count_voxels(rows, frame, solid, selection);
    return selection;
}

}  // namespace ellicast::sender
