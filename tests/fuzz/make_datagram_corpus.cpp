// tests/fuzz/make_datagram_corpus.cpp: writes the seeds of corpus/datagram, the same at every run.
//     build/release/tests/fuzz/make_datagram_corpus tests/fuzz/corpus/datagram
#include "protocol/datagram.hpp"
#include "tests/fuzz/corpus_writer.hpp"
#include "tests/protocol/golden_datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;

Bytes ellipsoids_only() {
    Random random(1);
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    writer.add_ellipsoids(2, 100, random_ellipsoids(3, sample_header().hint, random));
    return writer.finish();
}

/// Nine vertices: a whole block of the wide check and one more.
Bytes vertices_only() {
    Random random(2);
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    writer.add_vertices(49'000, 100, random_vertices(9, sample_header().hint, random));
    return writer.finish();
}

/// Nine vertices of every tag: the stream of bits ends within a byte.
Bytes tagged_vertices(std::uint8_t normal_bits) {
    Random random(4);
    const DatagramHeader header =
        sample_header(RecordFormat{.normal_bits = normal_bits, .ring = true, .colour = true});
    DatagramWriter writer(header, kMinDatagramBytes);
    writer.add_vertices(49'000, 100, random_vertices(9, header.hint, random));
    return writer.finish();
}

Bytes description_only() {
    DatagramHeader header = sample_header();
    header.rounds = 0;
    DatagramWriter writer(header, kMinDatagramBytes);
    (void)writer.add_description(sample_description());
    return writer.finish();
}

Bytes page_only() {
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    (void)writer.add_page(golden_page());
    return writer.finish();
}

Bytes edges_only() {
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    writer.add_edges(std::vector<EdgeRecord>{{50'000, 3, 4}, {50'000, 0, 49'999}});
    return writer.finish();
}

Bytes unknown_kinds() {
    return datagram_with(
        from_hex("c8 00 03 01 02 03 04 00 00 02 00 16 00 01 00 00 00 07 00 00 00 01 "
                 "00 00 00 00 3f 00 00 00 40 00 00 00 ff 00 01 00"));
}

Bytes most_sections() {
    Random random(3);
    DatagramWriter writer(sample_header(), kMinDatagramBytes);
    for (std::uint32_t k = 0; k < kMaxSections; ++k) {
        writer.add_vertices(k, 1 + k, random_vertices(1 + k % 2, sample_header().hint, random));
    }
    return writer.finish();
}

}  // namespace

int main(int argc, char** argv) {
    return write_corpus(argc, argv,
                        {{"golden", from_hex(kGoldenHex)},
                         {"golden-tagged", from_hex(kGoldenTaggedHex)},
                         {"tagged-12", tagged_vertices(12)},
                         {"tagged-16", tagged_vertices(16)},
                         {"ellipsoids", ellipsoids_only()},
                         {"vertices", vertices_only()},
                         {"description", description_only()},
                         {"page", page_only()},
                         {"edges", edges_only()},
                         {"unknown-kinds", unknown_kinds()},
                         {"most-sections", most_sections()},
                         {"no-section", datagram_with({})},
                         {"too-short", Bytes(20, 0x80)}});
}
