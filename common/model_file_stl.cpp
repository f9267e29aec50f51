// common/model_file_stl.cpp
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "common/model_file_check.hpp"
#include "common/model_file_text.hpp"

namespace ellicast::common {
namespace {

// Binary: 80 bytes of text, a count, and per facet a normal, three corners and 16 unused bits.
constexpr std::size_t kCountOffset = 80;
constexpr std::size_t kFirstFacet = 84;
constexpr std::size_t kFacetSize = 50;
constexpr std::size_t kCornersOffset = 12;

std::uint32_t load_u32(std::string_view bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        value |= std::uint32_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
    }
    return value;
}

bool is_binary(std::string_view bytes) {
    return bytes.size() >= kFirstFacet &&
           bytes.size() - kFirstFacet == std::uint64_t{kFacetSize} * load_u32(bytes, kCountOffset);
}

PlainModelFile check_binary(std::string bytes) {
    PlainModelFile file;
    file.binary = true;
    file.faces = load_u32(bytes, kCountOffset);
    for (std::size_t facet = 0; facet < file.faces; ++facet) {
        for (std::size_t i = 0; i < 9; ++i) {
            const std::size_t at = kFirstFacet + kFacetSize * facet + kCornersOffset + 4 * i;
            if (!std::isfinite(std::bit_cast<float>(load_u32(bytes, at)))) {
                throw BadModelFile("facet " + std::to_string(facet) +
                                   ": a coordinate is not finite");
            }
        }
    }
    file.bytes = std::move(bytes);
    return file;
}

// solid NAME / facet normal x y z / outer loop / vertex x y z (three times) / endloop / endfacet /
// ... / endsolid NAME, once or more. Names and normals do not get through.
class AsciiStlCheck {
  public:
    explicit AsciiStlCheck(const std::string& bytes) : scan_(bytes) {
        file_.bytes.reserve(bytes.size());
    }

    PlainModelFile run() {
        file_.bytes = "solid\n";
        std::string_view word = scan_.any_token();
        if (!same_word(word, "solid")) throw BadModelFile("not an STL file");
        while (!word.empty()) {
            if (!same_word(word, "solid")) unexpected(word);
            scan_.skip_line();
            read_solid();
            word = scan_.any_token();
        }
        file_.bytes += "endsolid\n";
        return std::move(file_);
    }

  private:
    void read_solid() {
        for (;;) {
            const std::string_view word = scan_.any_token();
            if (same_word(word, "endsolid")) break;
            if (!same_word(word, "facet")) unexpected(word);
            read_facet();
        }
        scan_.skip_line();
    }

    void read_facet() {
        expect("normal");
        for (int i = 0; i < 3; ++i) scan_.any_token();  // some programs write "nan" here
        expect("outer");
        expect("loop");
        file_.bytes += "facet normal 0 0 0\nouter loop\n";
        for (int corner = 0; corner < 3; ++corner) {
            expect("vertex");
            file_.bytes += "vertex";
            for (int i = 0; i < 3; ++i) {
                const std::string_view word = scan_.any_token();
                if (word.empty()) throw BadModelFile("truncated");
                parse_coordinate_float(word, scan_.line());
                file_.bytes += ' ';
                file_.bytes += word;
            }
            file_.bytes += '\n';
        }
        expect("endloop");
        expect("endfacet");
        file_.bytes += "endloop\nendfacet\n";
        ++file_.faces;
    }

    void expect(std::string_view keyword) {
        const std::string_view word = scan_.any_token();
        if (!same_word(word, keyword)) unexpected(word);
    }

    [[noreturn]] void unexpected(std::string_view word) const {
        if (word.empty()) throw BadModelFile("truncated");
        fail_at(scan_.line(), quoted(word) + " has no place here");
    }

    TextScanner scan_;
    PlainModelFile file_;
};

}  // namespace

PlainModelFile check_stl_file(std::string bytes) {
    PlainModelFile file;
    if (is_binary(bytes)) {
        file = check_binary(std::move(bytes));
    } else if (same_word(std::string_view(bytes).substr(0, 5), "solid")) {
        file = AsciiStlCheck(bytes).run();
    } else if (bytes.size() >= kFirstFacet) {
        throw BadModelFile("truncated or not an STL file: its header promises " +
                           std::to_string(load_u32(bytes, kCountOffset)) + " facets");
    } else {
        throw BadModelFile("truncated or not an STL file");
    }
    if (file.faces == 0) throw BadModelFile("no faces");
    file.vertices = 3 * file.faces;
    return file;
}

}  // namespace ellicast::common
