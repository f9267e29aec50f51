// tests/support/simulation.cpp
#include "tests/support/simulation.hpp"

#include <algorithm>
#include <ctime>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "common/model_io.hpp"
#include "common/random.hpp"
#include "receiver/output_files.hpp"
#include "tests/support/child_process.hpp"

namespace ellicast::tests {
namespace {

using namespace std::chrono_literals;

// One sender instance; any values do, as long as they stay the same.
constexpr protocol::SessionId kSession{0xe1, 0x11, 0xca, 0x57, 0, 0, 0, 1};
constexpr std::uint32_t kSsrc = 0x5eed;
constexpr std::uint16_t kFirstSequence = 65'000;  // so that long streams wrap around

}  // namespace

SimulatedModel load_simulated(const std::filesystem::path& path,
                              const sender::DecompositionOptions& options,
                              const sender::TagOptions& tags, sender::SendingOrder order) {
    return {common::read_model(path), sender::load_model(path, options, std::nullopt, tags, order)};
}

std::vector<TimedDatagram> broadcast(const sender::BroadcastObject& object,
                                     const BroadcastOptions& options) {
    sender::PlanOptions plan;
    plan.datagram_bytes = options.datagram_bytes;
    plan.copies = options.copies;
    plan.redundancy = options.redundancy;
    plan.rounds = options.rounds;
    plan.session = kSession;
    sender::SessionOptions how;
    how.ssrc = kSsrc;
    how.first_sequence = kFirstSequence;
    how.impairment = options.impairment;
    std::vector<sender::RoundPlan> plans;
    plans.emplace_back(object, plan);
    sender::Session session(std::move(plans), how);

    std::vector<TimedDatagram> sent;
    std::vector<sender::Datagram> batch;
    std::chrono::nanoseconds now = 1s;
    while (!session.done()) {
        batch.clear();
        session.poll(now, batch);
        for (sender::Datagram& datagram : batch) sent.push_back({now, std::move(datagram)});
        if (!session.done()) now = std::max(now, session.next_wakeup());
    }
    return sent;
}

SimulatedReception receive(const std::vector<TimedDatagram>& datagrams,
                           const receiver::SessionOptions& options) {
    receiver::SessionOptions how = options;
    if (!how.wait) how.wait = 2s;
    receiver::Session session(how, 1s);
    const receiver::Source source{{1, 2, 3}, 5004};
    std::chrono::nanoseconds now = 1s;
    const auto advance_to = [&](std::chrono::nanoseconds moment) {
        while (!session.finished()) {
            const auto due = session.next_wakeup();
            if (!due || *due > moment) break;
            now = std::max(now, *due);
            session.poll(now);
        }
        now = std::max(now, moment);
    };
    for (const TimedDatagram& datagram : datagrams) {
        advance_to(datagram.at);
        session.on_datagram(now, source, datagram.bytes);
    }
    advance_to(now + 3600s);
    session.interrupt(now);
    return {session.summary(now), session.store().snapshot()};
}

std::vector<TimedDatagram> shuffled_with_copies(std::vector<TimedDatagram> datagrams,
                                                std::uint64_t seed) {
    const std::size_t count = datagrams.size();
    for (std::size_t k = 0; k < count; k += 3) {
        TimedDatagram copy = datagrams[k];
        datagrams.push_back(std::move(copy));
    }
    common::Random random(seed);
    common::shuffle(datagrams, random);
    for (TimedDatagram& datagram : datagrams) datagram.at = 1s;
    return datagrams;
}

std::vector<TimedDatagram> stretched(std::vector<TimedDatagram> datagrams,
                                     std::chrono::nanoseconds length) {
    const std::chrono::nanoseconds start = datagrams.front().at;
    const std::chrono::duration<double> lasted = datagrams.back().at - start;
    for (TimedDatagram& datagram : datagrams) {
        const double share = std::chrono::duration<double>(datagram.at - start) / lasted;
        datagram.at = start + std::chrono::duration_cast<std::chrono::nanoseconds>(share * length);
    }
    return datagrams;
}

std::vector<TimedDatagram> without_blackout(const std::vector<TimedDatagram>& datagrams,
                                            std::chrono::nanoseconds begin,
                                            std::chrono::nanoseconds end) {
    std::vector<TimedDatagram> heard;
    for (const TimedDatagram& datagram : datagrams) {
        const std::chrono::nanoseconds at = datagram.at - datagrams.front().at;
        if (at < begin || at >= end) heard.push_back(datagram);
    }
    return heard;
}

std::vector<TimedDatagram> some_of(const std::vector<TimedDatagram>& datagrams, std::size_t count,
                                   std::uint64_t seed) {
    std::vector<std::size_t> chosen(datagrams.size());
    std::iota(chosen.begin(), chosen.end(), std::size_t{0});
    common::Random random(seed);
    common::shuffle(chosen, random);
    chosen.resize(count);
    std::sort(chosen.begin(), chosen.end());
    std::vector<TimedDatagram> some;
    for (const std::size_t k : chosen) some.push_back(datagrams[k]);
    return some;
}

std::string written_bytes(const SimulatedReception& reception, unsigned threads, int grid) {
    if (!reception.object) return "";
    receiver::ReconstructionOptions how;
    how.grid = grid;
    how.threads = threads;
    const auto result = receiver::reconstruct(*reception.object, how);
    if (!result) return "";
    const TemporaryDirectory directory;
    receiver::write_mesh(directory.path() / "out.ply", *result, *reception.object);
    return read_file(directory.path() / "out.ply");
}

double cpu_seconds() {
    std::timespec time{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool is_as_hinted(const common::MeshTopology& topology, const protocol::Hint& hint) {
    return topology.closed && topology.manifold && topology.components == hint.components &&
           topology.euler == hint.euler_all && topology.euler_largest == hint.euler_largest;
}

std::vector<Eigen::Vector3d> received_positions(const receiver::ReceivedObject& object) {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    if (object.description) origin = Eigen::Vector3d(object.description->origin.data());
    std::vector<Eigen::Vector3d> positions;
    positions.reserve(object.vertices.size());
    for (const protocol::VertexRecord& vertex : object.vertices) {
        const auto& [x, y, z] = vertex.position;
        positions.push_back(origin + Eigen::Vector3d(x, y, z));
    }
    return positions;
}

common::GilbertLoss bursty_loss(double loss, double mean_burst) {
    const double bad_to_good = 1.0 / mean_burst;
    const double good_to_bad = loss < 1.0 ? bad_to_good * loss / (1.0 - loss) : 2.0;
    if (!(mean_burst >= 1.0) || good_to_bad > 1.0) {
        throw std::invalid_argument("no bursts of mean length " + std::to_string(mean_burst) +
                                    " make a loss of " + std::to_string(loss));
    }
    return {good_to_bad, bad_to_good, 1.0, 0.0};
}

}  // namespace ellicast::tests
