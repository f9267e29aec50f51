// common/loss_text.cpp: loss processes as users write them.
#include <array>
#include <stdexcept>
#include <string>

#include "common/loss_model.hpp"
#include "common/number_text.hpp"

namespace ellicast::common {
namespace {

double parse_probability(std::string_view word, std::string_view text) {
    const auto p = number<double>(word);
    // Written so that NaN is refused, too.
    if (!p || !(*p >= 0.0 && *p <= 1.0)) {
        std::string reason("'");
        reason.append(word).append("' is not a probability between 0 and 1");
        throw refusal(text, reason);
    }
    return *p;
}

GilbertLoss parse_gilbert(std::string_view words, std::string_view text) {
    GilbertLoss loss;
    const std::array<double*, 4> fields{&loss.good_to_bad, &loss.bad_to_good, &loss.loss_bad,
                                        &loss.loss_good};
    std::size_t count = 0;
    for (bool more = true; more; ++count) {
        if (count == fields.size()) throw refusal(text, "more than p,r,lb,lg");
        const std::size_t comma = words.find(',');
        *fields[count] = parse_probability(words.substr(0, comma), text);
        more = comma != std::string_view::npos;
        if (more) words.remove_prefix(comma + 1);
    }
    if (count < 2) throw refusal(text, "gilbert needs at least p,r");
    return loss;
}

/// The words behind "name:", when the text begins so.
std::optional<std::string_view> behind(std::string_view name, std::string_view text) {
    const bool match =
        text.size() > name.size() && text.starts_with(name) && text[name.size()] == ':';
    if (!match) return std::nullopt;
    return text.substr(name.size() + 1);
}

}  // namespace

LossProcess parse_loss(std::string_view text) {
    if (const auto words = behind("bernoulli", text)) {
        return BernoulliLoss{parse_probability(*words, text)};
    }
    if (const auto words = behind("gilbert", text)) return parse_gilbert(*words, text);
    throw refusal(text, "expected bernoulli:P, gilbert:p,r[,lb[,lg]] or trace:FILE");
}

TraceLoss parse_trace(std::string_view content) {
    TraceLoss trace;
    bool comment = false;
    std::size_t line = 1;
    for (const char c : content) {
        if (c == '\n') {
            comment = false;
            ++line;
        } else if (c == '#') {
            comment = true;
        } else if (!comment && (c == '0' || c == '1')) {
            trace.lost.push_back(c == '1');
        } else if (!comment && c != ' ' && c != '\t' && c != '\r') {
            throw std::invalid_argument("loss trace, line " + std::to_string(line) +
                                        ": only 0, 1, white space and # comments are allowed");
        }
    }
    if (trace.lost.empty()) throw std::invalid_argument("loss trace: holds neither 0 nor 1");
    return trace;
}

}  // namespace ellicast::common
