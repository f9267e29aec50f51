// common/file_colours.cpp
#include "common/file_colours.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/number_text.hpp"

namespace ellicast::common {

std::uint8_t channel_of_number(double number) {
    if (!(number > 0.0)) return 0;
    return static_cast<std::uint8_t>(std::lround(std::min(number, 255.0)));
}

std::uint8_t channel_of_share(double share) {
    return channel_of_number(255.0 * share);
}

void FileColours::add(const std::array<std::string_view, 3>& words) {
    if (!sense_) return;
    std::array<float, 3> numbers{};
    for (std::size_t k = 0; k < 3; ++k) {
        const auto value = number<float>(words[k]);
        sense_ = sense_ && value && std::isfinite(*value);
        if (!sense_) return;
        numbers[k] = *value;
        greater_ = greater_ || *value > 1.0f;
    }
    numbers_.push_back(numbers);
}

std::vector<Colour> FileColours::take(std::size_t vertices) {
    const std::vector<std::array<float, 3>> numbers = std::exchange(numbers_, {});
    if (!sense_ || numbers.size() != vertices) return {};
    std::vector<Colour> colours;
    colours.reserve(vertices);
    for (const auto& triple : numbers) {
        Colour& colour = colours.emplace_back();
        std::ranges::transform(triple, colour.begin(), [&](double x) {
            return greater_ ? channel_of_number(x) : channel_of_share(x);
        });
    }
    return colours;
}

}  // namespace ellicast::common
