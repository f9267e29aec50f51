// common/file_colours.hpp: private to common/model_file_*.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/triangle_mesh.hpp"

namespace ellicast::common {

/// 0 to 1 as 0 to 255, the nearest; what is beyond (or no number) as the end that it is beyond.
std::uint8_t channel_of_share(double share);
/// The nearest of 0 to 255.
std::uint8_t channel_of_number(double number);

/// Red, green and blue of vertices as text formats list them, which do not say what is white. A
/// model is never refused for its colours: those that make no sense are no colours.
class FileColours {
  public:
    /// Of the next vertex.
    void add(const std::array<std::string_view, 3>& words);
    /// Shares of one, or of 255 as soon as any number is greater than 1. Empty unless there was a
    /// triple of numbers for every vertex. Nothing is left behind.
    std::vector<Colour> take(std::size_t vertices);

  private:
    std::vector<std::array<float, 3>> numbers_;
    bool sense_ = true;
    bool greater_ = false;  // than 1
};

}  // namespace ellicast::common
