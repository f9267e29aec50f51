// tests/fuzz/make_secured_corpus.cpp: writes the seeds of corpus/secured, the same at every run.
//     build/release/tests/fuzz/make_secured_corpus tests/fuzz/corpus/secured
#include "tests/fuzz/corpus_writer.hpp"
#include "tests/fuzz/receiver_script.hpp"
#include "tests/protocol/golden_secured.hpp"
#include "tests/protocol/wire_samples.hpp"
#include "tests/support/datagrams.hpp"

namespace {

using namespace ellicast;
using tests::kFixChecksum;
using tests::kPoll;
using tests::made_datagrams;
using tests::made_sphere;
using tests::MadeStream;
using tests::ReceiverScript;

constexpr std::uint8_t kTamper = 1 << 7;

/// A small sphere as contents; `session` decides which start it has.
void append_sphere(ReceiverScript& script, std::uint8_t session, std::uint8_t control) {
    MadeStream stream;
    stream.session[0] = session;
    stream.datagram_bytes = protocol::kMinDatagramBytes;
    for (const auto& datagram : made_datagrams(made_sphere(40, 4), stream)) {
        script.steps.push_back({control, datagram});
    }
}

ReceiverScript whole_object(std::uint8_t set_up) {
    ReceiverScript script{.set_up = set_up, .steps = {}};
    append_sphere(script, 1, kFixChecksum);
    return script;
}

/// A newer session, then the older one again; some are tampered with.
ReceiverScript replay() {
    ReceiverScript script{.set_up = 4, .steps = {}};
    append_sphere(script, 5, kFixChecksum | kPoll);
    append_sphere(script, 9, kFixChecksum);
    append_sphere(script, 5, kFixChecksum | 1);
    append_sphere(script, 9, kFixChecksum | kTamper);
    return script;
}

/// Into a queue of three: from one source, and from another that knows no key.
ReceiverScript crowd() {
    ReceiverScript script{.set_up = 8, .steps = {}};
    append_sphere(script, 1, kFixChecksum | kPoll);
    append_sphere(script, 1, kFixChecksum | kTamper | 2);
    append_sphere(script, 1, kFixChecksum);
    return script;
}

/// As they are, with other keys or none.
ReceiverScript strangers() {
    ReceiverScript script{.set_up = 3, .steps = {}};
    for (const char* const hex :
         {tests::kGoldenSealedHex, tests::kGoldenSignedHex, tests::kGoldenSealedSignedHex}) {
        script.steps.push_back({0, tests::from_hex(hex)});
    }
    append_sphere(script, 1, 0);
    return script;
}

}  // namespace

int main(int argc, char** argv) {
    return tests::write_corpus(argc, argv,
                               {{"signed", tests::encode_script(whole_object(0))},
                                {"sealed", tests::encode_script(whole_object(1))},
                                {"sealed-signed", tests::encode_script(whole_object(3))},
                                {"replay", tests::encode_script(replay())},
                                {"crowd", tests::encode_script(crowd())},
                                {"strangers", tests::encode_script(strangers())}});
}
