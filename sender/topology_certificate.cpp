// sender/topology_certificate.cpp
#include "sender/topology_certificate.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "common/coarse_surface.hpp"
#include "common/octahedral_normal.hpp"
#include "common/parallel.hpp"
#include "common/random.hpp"

namespace ellicast::sender {
namespace {

using protocol::SectionKind;

constexpr double kDoubt = 0.05;  // one-sided
constexpr std::size_t kFewestDraws = 50;
constexpr std::size_t kBlock = 16;  // draws between two looks at the misses

// P(X <= misses) for X misses of probability q in n draws, term by term.
double chance_of_at_most(std::size_t misses, std::size_t n, double q) {
    double term = std::pow(1.0 - q, static_cast<double>(n));
    double sum = term;
    for (std::size_t k = 0; k < misses; ++k) {
        term *= static_cast<double>(n - k) / static_cast<double>(k + 1) * q / (1.0 - q);
        sum += term;
    }
    return sum;
}

// The records that one datagram carries.
struct Cargo {
    std::vector<std::uint32_t> ellipsoids;
    std::vector<std::uint32_t> vertices;
};

std::vector<Cargo> cargo_of(const RoundPlan& plan) {
    std::vector<Cargo> cargo(plan.datagrams());
    for (std::uint32_t ordinal = 0; ordinal < plan.datagrams(); ++ordinal) {
        const std::vector<std::uint8_t> bytes = plan.datagram(0, ordinal, {});
        const auto view = protocol::parse_datagram(bytes);
        assert(view);
        for (const protocol::SectionView& section : view->sections()) {
            if (section.kind == SectionKind::description) continue;
            if (section.kind == SectionKind::page || section.kind == SectionKind::edges) continue;
            std::vector<std::uint32_t>& into = section.kind == SectionKind::ellipsoids
                                                   ? cargo[ordinal].ellipsoids
                                                   : cargo[ordinal].vertices;
            for (std::size_t k = 0; k < section.count; ++k) into.push_back(section.index(k));
        }
    }
    return cargo;
}

Eigen::Vector3d vector_of(const std::array<float, 3>& x) {
    return {x[0], x[1], x[2]};
}

common::Ellipsoid ellipsoid_of(const protocol::EllipsoidRecord& record) {
    common::Ellipsoid ellipsoid;
    std::size_t slot = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) ellipsoid.center[axis] = record.scalars[slot++];
    ellipsoid.L.setZero();
    for (Eigen::Index row = 0; row < 3; ++row) {
        for (Eigen::Index column = 0; column <= row; ++column) {
            ellipsoid.L(row, column) = record.scalars[slot++];
        }
    }
    return ellipsoid;
}

// The receivers of one plan, each with its own loss.
class Receivers {
  public:
    Receivers(const RoundPlan& plan, int cells) : cargo_(cargo_of(plan)), cells_(cells) {
        const protocol::Hint& hint = plan.object().hint;
        box_ = {vector_of(hint.box_min), vector_of(hint.box_max)};
        promise_ = {hint.components, hint.euler_all, hint.euler_largest};
        for (const auto& record : plan.object().ellipsoids) {
            ellipsoids_.push_back(ellipsoid_of(record));
        }
        for (const auto& record : plan.object().vertices) {
            points_.push_back(vector_of(record.position));
            if (const int bits = hint.format.normal_bits; bits != 0) {
                normals_.push_back(common::decode_normal(record.normal, bits));
            }
        }
    }

    [[nodiscard]] bool sees_topology(double loss, std::uint64_t seed) const {
        std::vector<bool> with_ellipsoid(ellipsoids_.size(), false);
        std::vector<bool> with_point(points_.size(), false);
        common::Random random(seed);
        for (const Cargo& cargo : cargo_) {
            if (random.chance(loss)) continue;
            for (const std::uint32_t e : cargo.ellipsoids) with_ellipsoid[e] = true;
            for (const std::uint32_t v : cargo.vertices) with_point[v] = true;
        }
        const std::vector<common::Ellipsoid> ellipsoids = those(ellipsoids_, with_ellipsoid);
        if (ellipsoids.empty()) return false;
        const std::vector<Eigen::Vector3d> points = those(points_, with_point);
        const std::vector<Eigen::Vector3d> normals =
            normals_.empty() ? normals_ : those(normals_, with_point);
        const auto surface =
            common::make_coarse_surface({ellipsoids, points, normals, box_}, promise_, cells_, 1);
        return surface && surface->as_promised;
    }

  private:
    // In index order, as a receiver takes them.
    template <class Record>
    static std::vector<Record> those(const std::vector<Record>& all, const std::vector<bool>& in) {
        std::vector<Record> result;
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (in[i]) result.push_back(all[i]);
        }
        return result;
    }

    std::vector<Cargo> cargo_;
    int cells_;
    Eigen::AlignedBox3d box_;
    common::PromisedTopology promise_;
    std::vector<common::Ellipsoid> ellipsoids_;
    std::vector<Eigen::Vector3d> points_;
    std::vector<Eigen::Vector3d> normals_;  // one a point, or none
};

bool reaches(const LossTrial& trial, const CertificateGoal& goal) {
    return trial.draws == draws_for(goal.share) &&
           share_at_least(trial.right, trial.draws) >= goal.share;
}

// Whether all further draws being right would still do.
bool can_reach(const LossTrial& trial, const CertificateGoal& goal) {
    const std::size_t draws = draws_for(goal.share);
    return share_at_least(draws - (trial.draws - trial.right), draws) >= goal.share;
}

// The certificate stands in every description, so that its length has a part in the layout.
BroadcastObject with_text(BroadcastObject object, const CertificateGoal& goal) {
    Certificate hoped{goal, true, draws_for(goal.share), draws_for(goal.share), 0, 0, 0};
    object.description.certificate = certificate_text(hoped);
    return object;
}

}  // namespace

double share_at_least(std::size_t right, std::size_t draws) {
    assert(right <= draws);
    if (right == 0) return 0.0;
    double low = 0.0, high = 1.0;  // of the chance to miss; the more, the fewer get so few
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        (chance_of_at_most(draws - right, draws, middle) > kDoubt ? low : high) = middle;
    }
    return 1.0 - high;
}

std::size_t draws_for(double share) {
    assert(share > 0.0 && share < 1.0);
    const double flawless = std::ceil(std::log(kDoubt) / std::log(share));
    return std::max(kFewestDraws, static_cast<std::size_t>(flawless));
}

LossTrial try_losses(const RoundPlan& plan, const TrialOptions& options) {
    const Receivers receivers(plan, options.cells);
    common::Random seeds(options.seed);
    LossTrial trial;
    const std::size_t draws = draws_for(options.goal.share);
    while (trial.draws < draws && can_reach(trial, options.goal)) {
        const std::size_t count = std::min(kBlock, draws - trial.draws);
        std::array<std::uint64_t, kBlock> seed{};
        for (std::size_t k = 0; k < count; ++k) seed[k] = seeds.next();
        std::array<bool, kBlock> right{};
        common::parallel_for(count, options.threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t k = first; k < last; ++k) {
                right[k] = receivers.sees_topology(options.goal.loss, seed[k]);
            }
        });
        trial.draws += count;
        trial.right += static_cast<std::size_t>(std::count(right.begin(), right.end(), true));
        if (options.on_draws) options.on_draws(trial);
    }
    return trial;
}

Certificate certificate_of(const CertificateGoal& goal, const LossTrial& trial, std::size_t copies,
                           std::size_t ellipsoids) {
    return {goal,
            reaches(trial, goal),
            trial.draws,
            trial.right,
            copies,
            ellipsoids,
            share_at_least(trial.right, trial.draws)};
}

std::string certificate_text(const Certificate& certificate) {
    if (!certificate.holds) return "";
    char text[96];
    std::snprintf(text, sizeof text, "topology %g at loss %g: %zu/%zu draws",
                  certificate.goal.share, certificate.goal.loss, certificate.right,
                  certificate.draws);
    return text;
}

Certificate certify(const std::function<BroadcastObject(std::size_t)>& object_of,
                    std::size_t ellipsoids, const PlanOptions& plan, const TrialOptions& options) {
    Certificate best;
    TrialOptions trial_options = options;
    for (const std::size_t count : {ellipsoids, ellipsoids + ellipsoids / 2, 2 * ellipsoids}) {
        const BroadcastObject object = with_text(object_of(count), options.goal);
        assert(!object.hint.approximate);
        PlanOptions plan_options = plan;
        const bool sound = Receivers(RoundPlan(object, plan), options.cells).sees_topology(0.0, 0);
        for (;;) {
            // Other draws each time: a plan must not profit from those that chose it.
            ++trial_options.seed;
            const RoundPlan tried(object, plan_options);
            const LossTrial trial = try_losses(tried, trial_options);
            const Certificate here =
                certificate_of(options.goal, trial, plan_options.copies, count);
            if (best.draws == 0 || here.holds || here.lower_bound > best.lower_bound) best = here;
            if (best.holds) return best;
            const std::size_t now = std::max(tried.copies(), plan_options.copies);
            if (!sound || now >= kMostCertifiedCopies) break;
            plan_options.copies = std::min(kMostCertifiedCopies, now + (now + 1) / 2);
        }
    }
    return best;
}

}  // namespace ellicast::sender
