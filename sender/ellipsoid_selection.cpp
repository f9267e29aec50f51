// sender/ellipsoid_selection.cpp
#include "sender/ellipsoid_selection.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/parallel.hpp"
#include "sender/ellipsoid_rows.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;
using common::GridFrame;

constexpr double kOne =
    1 << 16;  // fixed-point value of w = 1: 5 digits, and rows of 6000 voxels fit

// The rows of all candidates, worked out once and kept while memory allows. A selection looks at
// each row some six times; reading it takes a third of the time of working it out.
class CandidateRows {
  public:
    CandidateRows(std::span<const Ellipsoid> candidates, const GridFrame& frame, unsigned threads) {
        std::size_t layers = 0;
        for (const Ellipsoid& candidate : candidates) {
            rows_.emplace_back(candidate, frame);
            first_layer_.push_back(layers);
            const VoxelBox& box = rows_.back().box();
            layers += static_cast<std::size_t>(box.end[2] - box.begin[2]);
        }
        first_layer_.push_back(layers);
        keep(frame, threads);
    }

    [[nodiscard]] std::size_t size() const { return rows_.size(); }
    [[nodiscard]] const VoxelBox& box(std::size_t candidate) const {
        return rows_[candidate].box();
    }
    // Where the candidate's layers begin in an array of all layers.
    [[nodiscard]] std::size_t first_layer(std::size_t candidate) const {
        return first_layer_[candidate];
    }
    [[nodiscard]] std::size_t layers() const { return first_layer_.back(); }

    template <class Body>
    void for_each_in_layer(std::size_t candidate, int k, const Body& body) const {
        if (kept_layers_.empty()) {
            rows_[candidate].for_each_in_layer(k, body);
            return;
        }
        const std::size_t layer =
            first_layer_[candidate] + static_cast<std::size_t>(k - box(candidate).begin[2]);
        int j = kept_layers_[layer].first_j;
        for (std::size_t i = kept_layers_[layer].start; i < kept_layers_[layer + 1].start; ++i) {
            body(VoxelRow{j++, k, kept_rows_[i].begin, kept_rows_[i].end});
        }
    }

    template <class Body>
    void for_each(std::size_t candidate, int first_k, int last_k, const Body& body) const {
        const int end = std::min(last_k, box(candidate).end[2]);
        for (int k = std::max(first_k, box(candidate).begin[2]); k < end; ++k) {
            for_each_in_layer(candidate, k, body);
        }
    }

    template <class Body>
    void for_each(std::size_t candidate, const Body& body) const {
        for_each(candidate, box(candidate).begin[2], box(candidate).end[2], body);
    }

  private:
    struct KeptLayer {
        std::size_t start = 0;  // in kept_rows_
        int first_j = 0;
    };
    struct KeptRow {  // of consecutive j; empty ones too
        std::uint16_t begin = 0, end = 0;
    };

    void keep(const GridFrame& frame, unsigned threads);

    std::vector<EllipsoidRows> rows_;
    std::vector<std::size_t> first_layer_;
    std::vector<KeptLayer> kept_layers_;  // one more than layers; empty when rows are not kept
    std::vector<KeptRow> kept_rows_;
};

void CandidateRows::keep(const GridFrame& frame, unsigned threads) {
    constexpr std::size_t kMostRows = 1u << 25;  // 128 MB
    if (layers() > kMostRows || frame.dims[0] > std::numeric_limits<std::uint16_t>::max()) return;
    std::vector<KeptLayer> kept(layers() + 1);
    std::size_t count = 0;
    for (std::size_t c = 0; c < size(); ++c) {
        for (int k = box(c).begin[2]; k < box(c).end[2]; ++k) {
            const auto [first_j, last_j] = rows_[c].rows_of_layer(k);
            kept[first_layer_[c] + static_cast<std::size_t>(k - box(c).begin[2])] = {count,
                                                                                     first_j};
            count += static_cast<std::size_t>(last_j - first_j);
        }
        if (count > kMostRows) return;
    }
    kept.back().start = count;
    kept_rows_.resize(count);
    common::parallel_for(size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t c = first; c < last; ++c) {
            const KeptLayer* layer = kept.data() + first_layer_[c];
            for (int k = box(c).begin[2]; k < box(c).end[2]; ++k, ++layer) {
                rows_[c].for_each_in_layer(k, [&](const VoxelRow& row) {
                    kept_rows_[layer->start + static_cast<std::size_t>(row.j - layer->first_j)] = {
                        static_cast<std::uint16_t>(row.begin), static_cast<std::uint16_t>(row.end)};
                });
            }
        }
    });
    kept_layers_ = std::move(kept);
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

    [[nodiscard]] std::int64_t layer_gain(const CandidateRows& rows, std::size_t candidate,
                                          int k) const {
        std::int64_t sum = 0;
        rows.for_each_in_layer(candidate, k, [&](const VoxelRow& row) {
            const std::int32_t* sums = row_sums(row.j, row.k);
            sum += sums[row.end] - sums[row.begin];
        });
        return sum;
    }

    // Multiplies the gains of the solid's voxels inside by p; those outside keep their price.
    void cover(const CandidateRows& rows, std::size_t candidate, std::int64_t p_fixed);

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

void GainRows::cover(const CandidateRows& rows, std::size_t candidate, std::int64_t p_fixed) {
    rows.for_each(candidate, [&](const VoxelRow& row) {
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

// Sets values[i] for the row's nodes that are bare, and clears their bits.
void paint_bare(std::uint64_t* bits, const VoxelRow& row, float value, float* values) {
    for (int word = row.begin / 64; word <= (row.end - 1) / 64; ++word) {
        const int low = std::max(row.begin - 64 * word, 0);
        const int high = std::min(row.end - 64 * word, 64);
        const std::uint64_t range = (~std::uint64_t{0} >> (64 - (high - low))) << low;
        std::uint64_t open = bits[word] & range;
        bits[word] &= ~range;
        for (; open != 0; open &= open - 1) values[64 * word + std::countr_zero(open)] = value;
    }
}

// The largest minimum radius of all candidates over each voxel: how thick the solid is there. Thick
// candidates paint first and later ones only what is still bare, so that a voxel is written once.
std::vector<float> voxel_thickness(const CandidateRows& rows, const std::vector<float>& radii,
                                   const GridFrame& frame, unsigned threads) {
    std::vector<std::uint32_t> thickest_first(rows.size());
    std::iota(thickest_first.begin(), thickest_first.end(), 0u);
    std::stable_sort(thickest_first.begin(), thickest_first.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return radii[a] > radii[b]; });
    std::vector<float> thickness(frame.size(), 0.0f);
    // Per row, a bit for every bare node.
    const std::size_t words = (static_cast<std::size_t>(frame.dims[0]) + 63) / 64;
    std::vector<std::uint64_t> bare(words * frame.size() / static_cast<std::size_t>(frame.dims[0]),
                                    ~std::uint64_t{0});
    const auto slab = [&](std::size_t first, std::size_t last) {
        for (const std::uint32_t c : thickest_first) {
            const float radius = radii[c];
            rows.for_each(
                c, static_cast<int>(first), static_cast<int>(last), [&](const VoxelRow& row) {
                    if (row.begin >= row.end) return;
                    const std::size_t start = frame.index(0, row.j, row.k);
                    std::uint64_t* bits =
                        bare.data() + words * (start / static_cast<std::size_t>(frame.dims[0]));
                    paint_bare(bits, row, radius, thickness.data() + start);
                });
        }
    };
    common::parallel_for(static_cast<std::size_t>(frame.dims[2]), threads, slab);
    return thickness;
}

// The gains of all candidates, layer by layer. Weights only fall, so an old gain is an upper bound,
// and a layer's gain is still true where nothing was taken since.
class GainTable {
  public:
    GainTable(const GainRows& gains, const CandidateRows& rows, unsigned threads)
        : gains_(gains),
          rows_(rows),
          bounds_(rows.size()),
          layers_(rows.layers(), 0),
          outdated_(rows.layers(), 0) {
        common::parallel_for(rows.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t c = first; c < last; ++c) {
                const VoxelBox& box = rows.box(c);
                for (int k = box.begin[2]; k < box.end[2]; ++k) update(c, k);
            }
        });
    }

    // An upper bound of the candidate's gain; the gain itself while it is current.
    [[nodiscard]] std::int64_t bound(std::size_t candidate) const {
        return bounds_[candidate].total;
    }
    [[nodiscard]] bool is_current(std::size_t candidate) const {
        return bounds_[candidate].seen == taken_.size();
    }

    // Brings the gain up to date: only layers that something taken since has reached.
    void refresh(std::size_t candidate) {
        Bound& bound = bounds_[candidate];
        const VoxelBox& box = rows_.box(candidate);
        std::uint8_t* outdated = outdated_.data() + rows_.first_layer(candidate);
        for (; bound.seen < taken_.size(); ++bound.seen) {
            const VoxelBox& other = taken_[bound.seen];
            if (!other.overlaps(box)) continue;
            std::fill(outdated + std::max(0, other.begin[2] - box.begin[2]),
                      outdated + std::min(box.end[2], other.end[2]) - box.begin[2],
                      std::uint8_t{1});
        }
        for (int k = box.begin[2]; k < box.end[2]; ++k, ++outdated) {
            if (*outdated != 0) update(candidate, k);
            *outdated = 0;
        }
    }

    // Says that the candidate was taken, after its voxels were covered.
    void take(std::size_t candidate) { taken_.push_back(rows_.box(candidate)); }

  private:
    struct Bound {
        std::int64_t total = 0;  // sum of the candidate's layers
        std::size_t seen = 0;    // how many were taken when it was true
    };

    void update(std::size_t candidate, int k) {
        std::int64_t& gain = layers_[rows_.first_layer(candidate) +
                                     static_cast<std::size_t>(k - rows_.box(candidate).begin[2])];
        const std::int64_t now = gains_.layer_gain(rows_, candidate, k);
        bounds_[candidate].total += now - gain;
        gain = now;
    }

    const GainRows& gains_;
    const CandidateRows& rows_;
    std::vector<Bound> bounds_;
    std::vector<std::int64_t> layers_;    // gain of each layer when last looked at
    std::vector<std::uint8_t> outdated_;  // of each layer: something was taken there since
    std::vector<VoxelBox> taken_;
};

struct Entry {
    std::int64_t gain = 0;  // an upper bound
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
Entry take_best(LazyHeap& heap, GainTable& gains, const std::vector<float>& radii, double tie) {
    std::vector<Entry> rivals;
    std::int64_t least = 1;  // nothing gained is nothing worth
    while (!heap.empty() && heap.top().gain >= least) {
        Entry entry = heap.pop();
        if (!gains.is_current(entry.candidate)) {
            gains.refresh(entry.candidate);
            entry.gain = gains.bound(entry.candidate);
            heap.push(entry);
            continue;
        }
        if (rivals.empty()) {
            const double share = (1.0 - tie) * static_cast<double>(entry.gain);
            least = std::max<std::int64_t>(1, std::llround(share));
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

void count_voxels(const CandidateRows& rows, const GridFrame& frame,
                  std::span<const std::uint8_t> solid, Selection& selection) {
    std::vector<std::uint8_t> covered(frame.size(), 0);
    for (const std::uint32_t candidate : selection.order) {
        rows.for_each(candidate, [&](const VoxelRow& row) {
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
    const CandidateRows rows(candidates, frame, options.threads);
    const std::vector<float> radii = smallest_radii(candidates);

    GainRows gains(frame, solid);
    gains.set_weights(options,
                      options.thinness ? voxel_thickness(rows, radii, frame, options.threads)
                                       : std::vector<float>(),
                      options.threads);

    GainTable table(gains, rows, options.threads);
    std::vector<Entry> entries(candidates.size());
    for (std::uint32_t c = 0; c < entries.size(); ++c) entries[c] = {table.bound(c), c};
    LazyHeap heap(std::move(entries));
    const auto p_fixed = static_cast<std::int64_t>(std::lround(options.loss * kOne));
    Selection selection;
    while (selection.order.size() < options.count) {
        const Entry best = take_best(heap, table, radii, options.tie);
        if (best.gain <= 0) break;
        selection.order.push_back(best.candidate);
        gains.cover(rows, best.candidate, p_fixed);
        table.take(best.candidate);
    }
    count_voxels(rows, frame, solid, selection);
    return selection;
}

}  // namespace ellicast::sender
