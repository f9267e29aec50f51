// common/model_file_off.cpp
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "common/file_colours.hpp"
#include "common/model_file_check.hpp"
#include "common/model_file_text.hpp"

namespace ellicast::common {
namespace {

// [ST][C][N]OFF: vertices may carry normals, colours and texture coordinates behind x y z, one
// vertex a line, and faces a colour behind their corners, one face a line. None of that gets
// through; colours of vertices are kept aside where the keyword announces them.
class OffCheck {
  public:
    explicit OffCheck(const std::string& bytes) : size_(bytes.size()), scan_(bytes, '#') {}

    PlainModelFile run() {
        read_header();
        file_.bytes =
            "OFF\n" + std::to_string(file_.vertices) + " " + std::to_string(file_.faces) + " 0\n";
        file_.bytes.reserve(file_.bytes.size() + size_);
        file_.exact.reserve(file_.vertices);
        for (std::size_t i = 0; i < file_.vertices; ++i) read_vertex();
        for (std::size_t i = 0; i < file_.faces; ++i) read_face();
        file_.colours = colours_.take(file_.vertices);
        return std::move(file_);
    }

  private:
    void read_header() {
        if (!scan_.next_line()) throw BadModelFile("empty");
        std::string_view keyword = scan_.token();
        for (const std::string_view optional : {"ST", "C", "N"}) {
            if (!keyword.starts_with(optional)) continue;
            keyword.remove_prefix(optional.size());
            coloured_ = coloured_ || optional == "C";
            with_normals_ = with_normals_ || optional == "N";
        }
        if (keyword == "4OFF" || keyword == "nOFF" || keyword == "4nOFF") {
            throw BadModelFile("an OFF file of other than three dimensions");
        }
        if (keyword != "OFF") throw BadModelFile("not an OFF file");
        std::string_view word = scan_.token();
        if (word == "BINARY") throw BadModelFile("binary OFF is not supported, only text");
        if (word.empty() && !scan_.next_line()) throw BadModelFile("truncated");
        if (word.empty()) word = scan_.token();
        file_.vertices = read_count(word, 6);  // "0 0 0\n"
        file_.faces = read_count(scan_.token(), 2);
        if (file_.vertices == 0) throw BadModelFile("no vertices");
        if (file_.faces == 0) throw BadModelFile("no faces");
    }

    // A count of things of at least `bytes_each`; the last may lack its newline.
    std::size_t read_count(std::string_view word, std::size_t bytes_each) {
        const std::int64_t count = parse_integer(word, scan_.line());
        if (count < 0 || count > std::numeric_limits<std::int32_t>::max()) {
            fail_at(scan_.line(), "impossible count " + std::to_string(count));
        }
        if (static_cast<std::uint64_t>(count) > size_ / bytes_each + 1) {
            throw BadModelFile("truncated: its header promises " + std::to_string(count) +
                               " vertices or faces");
        }
        return static_cast<std::size_t>(count);
    }

    void next_entry() {
        if (!scan_.next_line()) throw BadModelFile("truncated");
    }

    void read_vertex() {
        next_entry();
        Eigen::Vector3d position;
        for (double& x : position) {
            const std::string_view word = scan_.token();
            x = parse_coordinate(word, scan_.line());
            file_.bytes += word;
            file_.bytes += ' ';
        }
        file_.bytes += '\n';
        file_.exact.push_back(position);
        if (coloured_) read_colour();
    }

    void read_colour() {
        for (int axis = 0; with_normals_ && axis < 3; ++axis) scan_.token();
        std::array<std::string_view, 3> colour;
        for (std::string_view& word : colour) word = scan_.token();
        colours_.add(colour);
    }

    void read_face() {
        next_entry();
        const std::size_t line = scan_.line();
        const std::int64_t corners = parse_integer(scan_.token(), line);
        if (corners < 0 || corners > static_cast<std::int64_t>(kMaxFaceCorners)) {
            fail_at(line, "a face of " + std::to_string(corners) + " corners (at most " +
                              std::to_string(kMaxFaceCorners) + ")");
        }
        file_.bytes += std::to_string(corners);
        for (std::int64_t corner = 0; corner < corners; ++corner) {
            const std::int64_t index = parse_integer(scan_.token(), line);
            if (index < 0 || static_cast<std::uint64_t>(index) >= file_.vertices) {
                fail_at(line, "index " + std::to_string(index) + " is out of range");
            }
            file_.bytes += ' ';
            file_.bytes += std::to_string(index);
        }
        file_.bytes += '\n';
    }

    std::size_t size_;
    TextScanner scan_;
    PlainModelFile file_;
    bool coloured_ = false;
    bool with_normals_ = false;
    FileColours colours_;
};

}  // namespace

PlainModelFile check_off_file(const std::string& bytes) {
    return OffCheck(bytes).run();
}

}  // namespace ellicast::common
