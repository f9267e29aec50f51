// common/model_file_obj.cpp
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

constexpr std::int64_t kMaxVertices = std::numeric_limits<std::int32_t>::max();

// Only `v` and `f` lines get through, with indices counted from the start of the file; colours
// behind `v x y z` are kept aside. All else
// (normals, texture coordinates, groups, curves, materials) says nothing of the shape as a set of
// faces.
class ObjCheck {
  public:
    explicit ObjCheck(const std::string& bytes) : scan_(bytes, '#', true) {
        file_.bytes.reserve(bytes.size());
    }

    PlainModelFile run() {
        while (scan_.next_line()) {
            const std::string_view keyword = scan_.token();
            if (keyword == "v") add_vertex();
            if (keyword == "f") add_face();
        }
        if (file_.exact.empty()) throw BadModelFile("no vertices");
        if (file_.faces == 0) throw BadModelFile("no faces");
        if (largest_ > static_cast<std::int64_t>(file_.exact.size())) {
            fail_at(line_of_largest_, "index " + std::to_string(largest_) + " is out of range");
        }
        file_.vertices = file_.exact.size();
        file_.colours = colours_.take(file_.vertices);
        return std::move(file_);
    }

  private:
    void add_vertex() {
        if (static_cast<std::int64_t>(file_.exact.size()) == kMaxVertices) {
            fail_at(scan_.line(), "too many vertices");
        }
        Eigen::Vector3d position;
        file_.bytes += 'v';
        for (double& x : position) {
            const std::string_view word = scan_.token();
            x = parse_coordinate(word, scan_.line());
            file_.bytes += ' ';
            file_.bytes += word;
        }
        file_.bytes += '\n';
        std::array<std::string_view, 3> colour;
        for (std::string_view& word : colour) word = scan_.token();
        // One number more is a weight; with four it is not said which is which.
        if (!colour[2].empty() && scan_.token().empty()) colours_.add(colour);
        file_.exact.push_back(position);
    }

    void add_face() {
        const std::size_t line = scan_.line();
        file_.bytes += 'f';
        std::size_t corners = 0;
        for (std::string_view word = scan_.token(); !word.empty(); word = scan_.token()) {
            if (++corners > kMaxFaceCorners) {
                fail_at(line,
                        "a face of more than " + std::to_string(kMaxFaceCorners) + " corners");
            }
            file_.bytes += ' ';
            file_.bytes += std::to_string(vertex_index(word, line));
        }
        if (corners < 3) fail_at(line, "a face of " + std::to_string(corners) + " corners");
        file_.bytes += '\n';
        ++file_.faces;
    }

    // "7", "7/1", "7//3", "7/1/3"; negative ones count back from the latest vertex.
    std::int64_t vertex_index(std::string_view word, std::size_t line) {
        std::int64_t result = 0;
        for (int part = 0;; ++part) {
            const std::size_t slash = word.find('/');
            const std::string_view number = word.substr(0, slash);
            const bool may_be_empty = part == 1 && slash != word.npos;
            if (!number.empty() || !may_be_empty) {
                const std::int64_t value = parse_integer(number, line);
                if (part == 0) result = value;
            }
            if (slash == word.npos) break;
            if (part == 2) fail_at(line, "a corner of more than three indices");
            word.remove_prefix(slash + 1);
        }
        const auto so_far = static_cast<std::int64_t>(file_.exact.size());
        if (result == 0 || result < -so_far || result > kMaxVertices) {
            fail_at(line, "index " + std::to_string(result) + " is out of range");
        }
        if (result < 0) return so_far + result + 1;
        if (result > largest_) {
            largest_ = result;  // a later line may still bring that vertex
            line_of_largest_ = line;
        }
        return result;
    }

    TextScanner scan_;
    PlainModelFile file_;
    FileColours colours_;
    std::int64_t largest_ = 0;
    std::size_t line_of_largest_ = 0;
};

}  // namespace

PlainModelFile check_obj_file(const std::string& bytes) {
    return ObjCheck(bytes).run();
}

}  // namespace ellicast::common
