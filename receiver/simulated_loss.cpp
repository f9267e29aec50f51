// receiver/simulated_loss.cpp
#include "receiver/simulated_loss.hpp"

#include <optional>
#include <utility>

#include "protocol/section_filter.hpp"

namespace ellicast::receiver {

using common::BernoulliLoss;
using common::LossStream;

SimulatedLoss::SimulatedLoss(const common::ImpairmentOptions& options) : options_(options) {}

SimulatedLoss::Network* SimulatedLoss::network_of(const Source& source) {
    const auto known = networks_.find(source);
    if (known != networks_.end()) return &known->second;
    if (networks_.size() >= kMaxNetworks) return nullptr;
    const auto sequence = [&](double p, LossStream stream) {
        return common::LossSequence(BernoulliLoss{p}, common::stream_seed(options_.seed, stream));
    };
    Network network{sequence(options_.drop_ellipsoids, LossStream::ellipsoids),
                    sequence(options_.drop_vertices, LossStream::vertices),
                    common::Impairment(options_)};
    return &networks_.emplace(source, std::move(network)).first->second;
}

void SimulatedLoss::offer(const Source& source, std::span<const std::uint8_t> datagram,
                          const Deliver& deliver) {
    Network* const network = network_of(source);
    if (!network) return;
    const auto keep = [&](const protocol::SectionView& section) {
        switch (section.kind) {
            case protocol::SectionKind::ellipsoids:
                return !network->ellipsoids.next_is_lost();
            case protocol::SectionKind::vertices:
                return !network->vertices.next_is_lost();
            case protocol::SectionKind::description:
            case protocol::SectionKind::page:
            case protocol::SectionKind::edges:
                return true;
        }
        return true;
    };
    std::optional<std::vector<std::uint8_t>> rest;
    if (options_.drop_ellipsoids > 0 || options_.drop_vertices > 0) {
        rest = protocol::keep_sections(datagram, keep);
    } else {
        rest.emplace(datagram.begin(), datagram.end());
    }
    if (!rest) return;
    delivered_.clear();
    network->impairment.offer(*std::move(rest), delivered_);
    for (const auto& bytes : delivered_) deliver(source, bytes);
}

void SimulatedLoss::flush(const Deliver& deliver) {
    for (auto& [source, network] : networks_) {
        delivered_.clear();
        network.impairment.flush(delivered_);
        for (const auto& bytes : delivered_) deliver(source, bytes);
    }
}

}  // namespace ellicast::receiver
