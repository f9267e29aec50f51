// tests/support/simulation.hpp: the whole pair in one process, with made-up time and no sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/mesh_distance.hpp"
#include "common/mesh_topology.hpp"
#include "common/triangle_mesh.hpp"
#include "receiver/reconstruction.hpp"
#include "receiver/session.hpp"
#include "sender/decomposition.hpp"
#include "sender/model_loading.hpp"
#include "sender/session.hpp"

namespace ellicast::tests {

/// A model as the user has it, and the object that a sender makes of it.
struct SimulatedModel {
    common::TriangleMesh original;
    sender::LoadedModel loaded;
};

/// Reads, prepares, decomposes; throws common::ModelError. Tags are those of the program's default.
SimulatedModel load_simulated(const std::filesystem::path& path,
                              const sender::DecompositionOptions& options = {},
                              const sender::TagOptions& tags = {},
                              sender::SendingOrder order = sender::SendingOrder::importance);

struct TimedDatagram {
    std::chrono::nanoseconds at{};
    std::vector<std::uint8_t> bytes;
};

struct BroadcastOptions {
    std::size_t datagram_bytes = 1200;
    std::size_t copies = 3;
    double redundancy = 1.0;
    std::uint32_t rounds = 1;
    common::ImpairmentOptions impairment;  // at the sender, as by its command line
};

/// What leaves the sender's core until it is done, paced at its default rate. Identity of the
/// stream is fixed, so that same object, options: same bytes.
std::vector<TimedDatagram> broadcast(const sender::BroadcastObject& object,
                                     const BroadcastOptions& options = {});

/// What a receiver's core makes of datagrams at these moments, until it ends by itself.
struct SimulatedReception {
    receiver::SessionSummary summary;
    std::optional<receiver::ReceivedObject> object;
};
SimulatedReception receive(const std::vector<TimedDatagram>& datagrams,
                           const receiver::SessionOptions& options = {});

/// The datagrams in another order, every third of them twice, all at one moment.
std::vector<TimedDatagram> shuffled_with_copies(std::vector<TimedDatagram> datagrams,
                                                std::uint64_t seed);

/// The datagrams farther apart, so that the last one leaves that long after the first.
std::vector<TimedDatagram> stretched(std::vector<TimedDatagram> datagrams,
                                     std::chrono::nanoseconds length);

/// Those that do not leave from `begin` to just before `end`, counted from the first one.
std::vector<TimedDatagram> without_blackout(const std::vector<TimedDatagram>& datagrams,
                                            std::chrono::nanoseconds begin,
                                            std::chrono::nanoseconds end);

/// So many of them, chosen at random, in their order.
std::vector<TimedDatagram> some_of(const std::vector<TimedDatagram>& datagrams, std::size_t count,
                                   std::uint64_t seed);

/// Bytes of the PLY that the receiver writes; empty when there is nothing to rebuild from.
std::string written_bytes(const SimulatedReception& reception, unsigned threads,
                          int grid = receiver::ReconstructionOptions{}.grid);

/// CPU seconds of the whole process so far.
double cpu_seconds();

/// Closed, manifold, and with the hinted components and Euler characteristics.
bool is_as_hinted(const common::MeshTopology& topology, const protocol::Hint& hint);

/// Positions of the received vertices in the frame of the model's file.
std::vector<Eigen::Vector3d> received_positions(const receiver::ReceivedObject& object);

/// A loss of this probability as a Gilbert chain whose bursts have this mean length. Throws
/// std::invalid_argument where there is none: good stretches cannot be shorter than one datagram.
common::GilbertLoss bursty_loss(double loss, double mean_burst);

}  // namespace ellicast::tests
