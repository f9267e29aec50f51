// receiver/simulated_loss.hpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "common/loss_model.hpp"
#include "receiver/arrival.hpp"

namespace ellicast::receiver {

/// The loss options at the receiver: datagrams go in as they came, and what the simulated network
/// leaves of them comes out. Sections of the dropped kinds are cut out first, then whole datagrams
/// suffer. Each source has a network of its own, with the same seed, so that one sender's fate does
/// not hang on another's traffic; beyond kMaxNetworks sources, what comes from further ones is
/// lost.
class SimulatedLoss {
  public:
    using Deliver = std::function<void(const Source&, std::span<const std::uint8_t>)>;
    static constexpr std::size_t kMaxNetworks = 64;

    explicit SimulatedLoss(const common::ImpairmentOptions& options);

    void offer(const Source& source, std::span<const std::uint8_t> datagram,
               const Deliver& deliver);
    /// Delivers what reordering still holds back.
    void flush(const Deliver& deliver);

  private:
    struct Network {
        common::LossSequence ellipsoids;
        common::LossSequence vertices;
        common::Impairment impairment;
    };
    Network* network_of(const Source& source);

    common::ImpairmentOptions options_;
    std::map<Source, Network> networks_;
    std::vector<std::vector<std::uint8_t>> delivered_;  // kept for its capacity
};

}  // namespace ellicast::receiver
