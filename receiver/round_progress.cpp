// receiver/round_progress.cpp
#include "receiver/round_progress.hpp"

#include <algorithm>

namespace ellicast::receiver {

void RoundProgress::on_header(Time now, const protocol::DatagramHeader& header) {
    const std::uint64_t round = header.round;
    const bool first = header.ordinal == 0;
    const bool last = header.ordinal + 1 == header.datagrams;
    round_ = std::max(round_, header.round);
    rounds_over_ = std::max(rounds_over_, last ? round + 1 : round);
    if (!joined_) {
        joined_ = true;
        full_round_ = first ? round : round + 1;
    } else if (first && round < full_round_) {
        full_round_ = round;  // the network let a later datagram overtake the first
    }
    if (!full_round_end_ && (round > full_round_ || (round == full_round_ && last))) {
        full_round_end_ = now;
    }
    if (!stream_end_ && last && header.rounds != 0 && header.round + 1 == header.rounds) {
        stream_end_ = now;
    }
}

}  // namespace ellicast::receiver
