// tests/fuzz/make_receiver_corpus.cpp: writes the seeds of corpus/receiver, the same at every run.
//     build/release/tests/fuzz/make_receiver_corpus tests/fuzz/corpus/receiver
#include "tests/fuzz/corpus_writer.hpp"
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

/// Two pages of a carousel, of which one changes.
ReceiverScript carousel() {
    ReceiverScript script{.set_up = 16, .steps = {}};
    const MadeStream stream = small_stream(1, 0);
    std::vector<MadeObject> objects{made_sphere(40, 4, 1), made_sphere(50, 3, 2)};
    objects[1].description.name = "second";
    for (std::uint32_t version = 1; version <= 2; ++version) {
        for (std::uint16_t page = 0; page < 2; ++page) {
            const MadeObject& object = objects[page];
            protocol::PageEntry entry;
            entry.page = page;
            entry.pages = 2;
            entry.version = page == 0 ? version : 1;
            entry.object = object.id;
            entry.name = object.description.name;
            protocol::DatagramWriter writer(made_header(object, stream),
                                            protocol::kMinDatagramBytes);
            if (writer.add_page(entry)) script.steps.push_back({kFixChecksum, writer.finish()});
            append(script, made_datagrams(object, stream), kFixChecksum | pause(1));
        }
        objects[0] = made_sphere(40, 4, 7);
    }
    return script;
}

}  // namespace

int main(int argc, char** argv) {
    return tests::write_corpus(argc, argv,
                               {{"whole-object", tests::encode_script(whole_object())},
                                {"rounds-with-loss", tests::encode_script(rounds_with_loss())},
                                {"restarted-sender", tests::encode_script(restarted_sender())},
                                {"strangers", tests::encode_script(strangers_in_little_room())},
                                {"contradictions", tests::encode_script(contradictions())},
                                {"carousel", tests::encode_script(carousel())},
                                {"tagged-objects", tests::encode_script(tagged_objects())}});
}
