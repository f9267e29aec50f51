// tests/support/made_network.hpp: hosts on one cable, as network namespaces of this process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ellicast::tests {

/// What a finished program said.
struct ProgramOutcome {
    int code = 127;
    std::string out;
    std::string err;
};

/// Runs a program that the path finds, to its end.
ProgramOutcome run_program(const std::vector<std::string>& words);

/// One sending and some receiving hosts on a switch; gone with the object. The sender is 10.77.0.1
/// and fd77::1, receiver k is 10.77.0.(2 + k) and fd77::(2 + k), k from 0 to 8; interfaces are
/// called "near". Everything sent to any group reaches every host.
class MadeNetwork {
  public:
    explicit MadeNetwork(std::size_t receivers = 1);
    ~MadeNetwork();
    MadeNetwork(const MadeNetwork&) = delete;
    MadeNetwork& operator=(const MadeNetwork&) = delete;

    /// Empty when all is there; else why not, for a test to say that it skips.
    [[nodiscard]] const std::string& missing() const { return missing_; }

    /// Namespaces, and what to write in front of a program to run it there.
    [[nodiscard]] std::string sender() const { return name_ + "-send"; }
    [[nodiscard]] std::string receiver(std::size_t k = 0) const {
        return name_ + "-recv" + std::to_string(k);
    }
    static std::vector<std::string> inside(const std::string& space,
                                           const std::vector<std::string>& words);

    /// Drops a share of the UDP datagrams to port 5004 that reach the receiving host, by nft or
    /// iptables; false where the kernel cannot.
    bool lose(int percent, std::size_t receiver = 0);
    /// Datagrams that the rules dropped.
    [[nodiscard]] std::uint64_t dropped(std::size_t receiver = 0) const;

    /// Takes a host's interface down, or up again; the host by its namespace.
    static bool set_link(const std::string& space, bool up);
    /// Pulls a host's interface out, so that it is gone, and puts in a new one of the same name and
    /// address.
    static bool unplug(const std::string& space);
    [[nodiscard]] bool plug_in(const std::string& space) const;

    /// Drops a share of the RTP packets to port 5004 on their way to the receiving host, in the
    /// switch: captures there see what is left, while those of `lose` see everything. The packet
    /// with the first sequence number and the one with the marker bit pass, so that every gap lies
    /// between two packets. False where the kernel cannot.
    bool lose_on_the_way(int percent, std::uint16_t first_sequence, std::size_t receiver = 0);
    /// Packets that the switch dropped, to all receivers.
    [[nodiscard]] std::uint64_t dropped_on_the_way() const;

    /// What has left the sender for port 5004 since the first call, which gives zeros.
    struct Traffic {
        std::uint64_t packets = 0;
        std::uint64_t bytes = 0;  // of IP packets
        bool operator==(const Traffic&) const = default;
    };
    Traffic left_sender();

  private:
    [[nodiscard]] bool in(const std::string& space, const std::vector<std::string>& words) const;
    [[nodiscard]] Traffic counted(const std::string& space,
                                  const std::string& family = "inet") const;
    [[nodiscard]] std::string hub() const { return name_ + "-switch"; }
    [[nodiscard]] bool connect(const std::string& space, std::size_t number) const;
    [[nodiscard]] bool add_host(const std::string& space, std::size_t number) const;

    std::string name_;
    std::size_t receivers_;
    std::string missing_;
    bool with_nft_ = true;
    bool counts_sender_ = false;
};

}  // namespace ellicast::tests
