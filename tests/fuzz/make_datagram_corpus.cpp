// tests/fuzz/make_datagram_corpus.cpp: writes the seeds of corpus/datagram, the same at every run.
//     build/release/tests/fuzz/make_datagram_corpus tests/fuzz/corpus/datagram
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "protocol/datagram.hpp"
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

bool write(const std::filesystem::path& folder, const char* name, const Bytes& bytes) {
    const std::string text(bytes.begin(), bytes.end());
    std::ofstream file(folder / name, std::ios::binary);
    file << text;
    return static_cast<bool>(file.flush());
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: make_datagram_corpus FOLDER\n");
        return 2;
    }
    const std::filesystem::path folder = argv[1];
    const bool written = write(folder, "golden", from_hex(kGoldenHex)) &&
                         write(folder, "golden-tagged", from_hex(kGoldenTaggedHex)) &&
                         write(folder, "tagged-12", tagged_vertices(12)) &&
                         write(folder, "tagged-16", tagged_vertices(16)) &&
                         write(folder, "ellipsoids", ellipsoids_only()) &&
                         write(folder, "vertices", vertices_only()) &&
                         write(folder, "description", description_only()) &&
                         write(folder, "unknown-kinds", unknown_kinds()) &&
                         write(folder, "most-sections", most_sections()) &&
                         write(folder, "no-section", datagram_with({})) &&
                         write(folder, "too-short", Bytes(20, 0x80));
    if (!written) std::fprintf(stderr, "make_datagram_corpus: cannot write to %s\n", argv[1]);
    return written ? 0 : 2;
}
