// tests/fuzz/make_receiver_corpus.cpp: writes the seeds of corpus/receiver, the same at every run.
//     build/release/tests/fuzz/make_receiver_corpus tests/fuzz/corpus/receiver
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/fuzz/receiver_script.hpp"
#include "tests/support/datagrams.hpp"

namespace {

using namespace ellicast;
using tests::kFixChecksum;
using tests::kPoll;
using tests::made_datagrams;
using tests::made_sphere;
using tests::MadeObject;
using tests::MadeStream;
using tests::ReceiverScript;

MadeStream small_stream(std::uint8_t session, std::uint32_t rounds = 1) {
    MadeStream stream;
    stream.session[0] = session;
    stream.rounds = rounds;
    stream.datagram_bytes = protocol::kMinDatagramBytes;
    return stream;
}

void append(ReceiverScript& script, const std::vector<tests::Datagram>& datagrams,
            std::uint8_t control) {
    for (const auto& datagram : datagrams) script.steps.push_back({control, datagram});
}

constexpr std::uint8_t pause(int kind) {
    return static_cast<std::uint8_t>(kind << 2);
}

ReceiverScript whole_object() {
    ReceiverScript script;
    append(script, made_datagrams(made_sphere(40, 5), small_stream(1)), kFixChecksum | pause(1));
    return script;
}

/// Two senders of one sphere: with all tags, and later with others.
ReceiverScript tagged_objects() {
    ReceiverScript script{.set_up = 1, .steps = {}};
    MadeObject object = made_sphere(40, 5);
    add_tags(object, {.normal_bits = 12, .ring = true, .colour = true});
    append(script, made_datagrams(object, small_stream(1)), kFixChecksum);
    add_tags(object, {.normal_bits = 8});
    append(script, made_datagrams(object, small_stream(1)), kFixChecksum | pause(1));
    return script;
}

ReceiverScript rounds_with_loss() {
    ReceiverScript script{.set_up = 2 | 4, .steps = {}};
    append(script, made_datagrams(made_sphere(60, 4), small_stream(1, 2)),
           kFixChecksum | kPoll | pause(2));
    return script;
}

ReceiverScript restarted_sender() {
    ReceiverScript script{.set_up = 1, .steps = {}};
    const MadeObject object = made_sphere(60, 4);
    append(script, made_datagrams(object, small_stream(1)), kFixChecksum);
    script.steps.pop_back();
    append(script, made_datagrams(object, small_stream(2)), kFixChecksum | pause(6) | 1);
    return script;
}

ReceiverScript strangers_in_little_room() {
    ReceiverScript script{.set_up = 3 | 8, .steps = {}};
    for (std::uint8_t k = 0; k < 5; ++k) {
        append(script, made_datagrams(made_sphere(50, 2, k), small_stream(k)),
               static_cast<std::uint8_t>(kFixChecksum | (k & 3)));
    }
    return script;
}

ReceiverScript contradictions() {
    ReceiverScript script{.set_up = 3, .steps = {}};
    MadeObject object = made_sphere(60, 3);
    append(script, made_datagrams(object, small_stream(1)), kFixChecksum);
    object.vertices[4].position[0] *= 0.5f;
    object.ellipsoids[1].scalars[0] = 0.f;
    object.description.name = "another";
    append(script, made_datagrams(object, small_stream(1)), kFixChecksum);
    object.hint.components = 2;
    append(script, made_datagrams(object, small_stream(1)), kFixChecksum);
    return script;
}

bool write(const std::filesystem::path& folder, const char* name, const ReceiverScript& script) {
    const auto bytes = encode_script(script);
    std::ofstream file(folder / name, std::ios::binary);
    file << std::string(bytes.begin(), bytes.end());
    return static_cast<bool>(file.flush());
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: make_receiver_corpus FOLDER\n");
        return 2;
    }
    const std::filesystem::path folder = argv[1];
    const bool written = write(folder, "whole-object", whole_object()) &&
                         write(folder, "rounds-with-loss", rounds_with_loss()) &&
                         write(folder, "restarted-sender", restarted_sender()) &&
                         write(folder, "strangers", strangers_in_little_room()) &&
                         write(folder, "contradictions", contradictions()) &&
                         write(folder, "tagged-objects", tagged_objects());
    if (!written) std::fprintf(stderr, "make_receiver_corpus: cannot write to %s\n", argv[1]);
    return written ? 0 : 2;
}
