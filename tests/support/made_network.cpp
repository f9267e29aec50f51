#include "tests/support/made_network.hpp"

#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/support/child_process.hpp"

namespace ellicast::tests {
namespace {

using nlohmann::json;
using Words = std::vector<std::string>;

bool succeeds(const Words& words) {
    return run_program(words).code == 0;
}

bool shell(const std::string& commands) {
    return succeeds({"sh", "-ec", commands});
}

}  // namespace

ProgramOutcome run_program(const Words& words) {
    ChildProcess process("/usr/bin/env", words);  // env looks the program up
    ProgramOutcome outcome;
    outcome.code = process.wait();
    outcome.out = process.out();
    outcome.err = process.err();
    return outcome;
}

Words MadeNetwork::inside(const std::string& space, const Words& words) {
    Words all{"ip", "netns", "exec", space};
    all.insert(all.end(), words.begin(), words.end());
    return all;
}

MadeNetwork::MadeNetwork(std::size_t receivers)
    : name_("ellicast-" + std::to_string(::getpid())), receivers_(receivers) {
    if (::geteuid() != 0 || !succeeds({"ip", "-V"})) {
        missing_ = "network namespaces need root and iproute2";
        return;
    }
    const std::string space = name_ + "-switch";
    bool made = shell("ip netns add " + space + "; ip -n " + space +
                      " link add switch type bridge mcast_snooping 0; ip -n " + space +
                      " link set switch up");
    made = made && add_host(sender(), 1);
    for (std::size_t k = 0; made && k < receivers; ++k) made = add_host(receiver(k), 2 + k);
    if (!made) missing_ = "no rights to make network namespaces joined by a bridge";
}

MadeNetwork::~MadeNetwork() {
    // Programs first: a namespace lives on while one is in it.
    std::string commands;
    for (std::size_t k = 0; k < receivers_; ++k) commands += "ip netns del " + receiver(k) + "; ";
    commands += "ip netns del " + sender() + "; ip netns del " + name_ + "-switch";
    run_program({"sh", "-c", commands});
}

bool MadeNetwork::add_host(const std::string& space, std::size_t number) const {
    return shell("ip netns add " + space + "; ip -n " + space + " link set lo up") &&
           connect(space, number);
}

bool MadeNetwork::connect(const std::string& space, std::size_t number) const {
    const std::string digit = std::to_string(number);
    const std::string port = "port" + digit;
    const std::string hub = "ip -n " + name_ + "-switch link ";
    const std::string ip = "ip -n " + space + " ";
    // Without waiting for somebody else to claim the address, and without one that another
    // interface of the same name would not have.
    return shell(hub + "add " + port + " type veth peer name near netns " + space + "; " + hub +
                 "set " + port + " master switch up; " + ip +
                 "link set near addrgenmode none up; " + ip + "address add 10.77.0." + digit +
                 "/24 broadcast + dev near; " + ip + "address add fd77::" + digit +
                 "/64 dev near nodad");
}

bool MadeNetwork::set_link(const std::string& space, bool up) {
    return succeeds({"ip", "-n", space, "link", "set", "near", up ? "up" : "down"});
}

bool MadeNetwork::unplug(const std::string& space) {
    return succeeds({"ip", "-n", space, "link", "del", "near"});
}

bool MadeNetwork::plug_in(const std::string& space) const {
    if (space == sender()) return connect(space, 1);
    for (std::size_t k = 0; k < receivers_; ++k) {
        if (space == receiver(k)) return connect(space, 2 + k);
    }
    return false;
}

bool MadeNetwork::in(const std::string& space, const Words& words) const {
    return succeeds(inside(space, words));
}

bool MadeNetwork::lose(int percent, std::size_t receiver) {
    if (percent == 0) return true;
    const std::string space = this->receiver(receiver);
    with_nft_ =
        in(space, {"nft", "add table inet watch"}) &&
        in(space, {"nft", "add chain inet watch in { type filter hook input priority 0; }"}) &&
        in(space, {"nft",
                   "add rule inet watch in iifname \"near\" udp dport 5004 numgen random mod 100 "
                   "< " +
                       std::to_string(percent) + " counter drop"});
    if (with_nft_) return true;
    bool both = true;
    for (const std::string tool : {"iptables", "ip6tables"}) {
        both = both && in(space, {tool, "-A", "INPUT", "-i", "near", "-p", "udp", "--dport", "5004",
                                  "-m", "statistic", "--mode", "random", "--probability",
                                  std::to_string(percent / 100.0), "-j", "DROP"});
    }
    return both;
}

MadeNetwork::Traffic MadeNetwork::counted(const std::string& space,
                                          const std::string& family) const {
    const ProgramOutcome listed =
        run_program(inside(space, {"nft", "-j", "list", "table", family, "watch"}));
    Traffic sum;
    if (listed.code != 0) return sum;  // nothing was to be dropped
    const json rules = json::parse(listed.out);
    for (const json& item : rules["nftables"]) {
        if (!item.contains("rule")) continue;
        for (const json& part : item["rule"]["expr"]) {
            if (!part.contains("counter")) continue;
            sum.packets += part["counter"]["packets"].get<std::uint64_t>();
            sum.bytes += part["counter"]["bytes"].get<std::uint64_t>();
        }
    }
    return sum;
}

std::uint64_t MadeNetwork::dropped(std::size_t receiver) const {
    const std::string space = this->receiver(receiver);
    if (with_nft_) return counted(space).packets;
    std::uint64_t sum = 0;
    for (const std::string tool : {"iptables", "ip6tables"}) {
        const ProgramOutcome listed =
            run_program(inside(space, {tool, "-L", "INPUT", "1", "-v", "-x", "-n"}));
        sum += std::strtoull(listed.out.c_str(), nullptr, 10);
    }
    return sum;
}

bool MadeNetwork::lose_on_the_way(int percent, std::uint16_t first_sequence, std::size_t receiver) {
    // Behind eight bytes of UDP: at bit 72 the marker, at bit 80 the sequence number.
    return in(hub(), {"nft", "add table bridge watch"}) &&
           in(hub(),
              {"nft", "add chain bridge watch on { type filter hook forward priority 0; }"}) &&
           in(hub(),
              {"nft",
               "add rule bridge watch on oifname \"port" + std::to_string(2 + receiver) +
                   "\" udp dport 5004 @th,72,1 0 @th,80,16 != " + std::to_string(first_sequence) +
                   " numgen random mod 100 < " + std::to_string(percent) + " counter drop"});
}

std::uint64_t MadeNetwork::dropped_on_the_way() const {
    return counted(hub(), "bridge").packets;
}

MadeNetwork::Traffic MadeNetwork::left_sender() {
    if (!counts_sender_) {
        counts_sender_ =
            in(sender(), {"nft", "add table inet watch"}) &&
            in(sender(),
               {"nft", "add chain inet watch out { type filter hook output priority 0; }"}) &&
            in(sender(), {"nft", "add rule inet watch out udp dport 5004 counter"});
    }
    return counts_sender_ ? counted(sender()) : Traffic{};
}

}  // namespace ellicast::tests
