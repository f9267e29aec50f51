// sender/topology_certificate.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "sender/broadcast_object.hpp"
#include "sender/round_plan.hpp"

namespace ellicast::sender {

/// What is to be certified: of the receivers that lose each datagram of one round with probability
/// `loss`, independently, a share of at least `share` makes a coarse surface with the promised
/// components and Euler characteristics.
struct CertificateGoal {
    double loss = 0.5;    // 0 to 1, 1 excluded
    double share = 0.95;  // 0 to 1, both excluded
    bool operator==(const CertificateGoal&) const = default;
};

/// One-sided 95 % lower bound of a probability after `right` of `draws` independent draws were
/// right: the p at which so many or more come about with probability 0.05 ([CP34]). 0 when none was
/// right.
double share_at_least(std::size_t right, std::size_t draws);

/// How many draws to make for a share: at least 50, and so many that a flawless series bounds the
/// probability by `share` (50 do up to 0.941; 59 for 0.95, 299 for 0.99).
std::size_t draws_for(double share);

/// How a plan fared.
struct LossTrial {
    std::size_t draws = 0;  // made; fewer than asked for once the goal is out of reach
    std::size_t right = 0;
};

struct TrialOptions {
    CertificateGoal goal;
    std::uint64_t seed = 1;
    int cells = 96;                                       // of the receiver's grid
    unsigned threads = 0;                                 // does not change the result
    std::function<void(const LossTrial&)> on_draws = {};  // called now and then; may be empty
};

/// Draws the loss of each datagram of round 0, and gives the surviving records to the receiver's
/// coarse stage, common::make_coarse_surface. Who carries what is read from the datagrams
/// themselves. Stops early, after a fixed number of draws whatever the threads, when misses rule
/// the goal out. Cost: per draw, a distance grid and one to some marching cubes (horse: 0.1 s).
LossTrial try_losses(const RoundPlan& plan, const TrialOptions& options);

/// What was reached. `lower_bound` counts the draws of the last plan tried alone: that a few plans
/// were tried before is not charged for.
struct Certificate {
    CertificateGoal goal;
    bool holds = false;
    std::size_t draws = 0;
    std::size_t right = 0;
    std::size_t copies = 0;      // of every ellipsoid in a round, to be planned with
    std::size_t ellipsoids = 0;  // asked for
    double lower_bound = 0;
};

/// Of a trial that was made with so many copies and ellipsoids.
Certificate certificate_of(const CertificateGoal& goal, const LossTrial& trial, std::size_t copies,
                           std::size_t ellipsoids);

/// For the description: "topology 0.95 at loss 0.5: 59/59 draws"; empty unless it holds.
std::string certificate_text(const Certificate& certificate);

/// Looks for a plan that reaches the goal: more copies first, up to kMostCertifiedCopies, since
/// they change nothing for who loses nothing; then, or at once when even without loss the topology
/// is wrong, half as many ellipsoids again, and twice as many. When none reaches it, the best of
/// them. `object_of(n)` makes the object with n ellipsoids. Requires a topology that is promised,
/// not approximate (asserted).
inline constexpr std::size_t kMostCertifiedCopies = 16;
Certificate certify(const std::function<BroadcastObject(std::size_t)>& object_of,
                    std::size_t ellipsoids, const PlanOptions& plan, const TrialOptions& options);

}  // namespace ellicast::sender
