// tests/common/loss_text_test.cpp: loss processes as users write them.
#include <catch2/catch.hpp>
#include <string>

#include "common/loss_model.hpp"

namespace {

using namespace ellicast::common;

std::string refusal_of_loss(std::string_view text) {
    try {
        (void)parse_loss(text);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return {};
}

}  // namespace

TEST_CASE("loss processes are read as written") {
    CHECK(std::get<BernoulliLoss>(parse_loss("bernoulli:0.25")).p == 0.25);
    CHECK(std::get<BernoulliLoss>(parse_loss("bernoulli:0")).p == 0.0);
    CHECK(std::get<BernoulliLoss>(parse_loss("bernoulli:1e-3")).p == 1e-3);
    const auto two = std::get<GilbertLoss>(parse_loss("gilbert:0.1,0.5"));
    CHECK((two.good_to_bad == 0.1 && two.bad_to_good == 0.5));
    CHECK((two.loss_bad == 1.0 && two.loss_good == 0.0));
    const auto three = std::get<GilbertLoss>(parse_loss("gilbert:0.1,0.5,0.9"));
    CHECK((three.loss_bad == 0.9 && three.loss_good == 0.0));
    const auto four = std::get<GilbertLoss>(parse_loss("gilbert:1,0,0.75,0.01"));
    CHECK((four.good_to_bad == 1.0 && four.bad_to_good == 0.0));
    CHECK((four.loss_bad == 0.75 && four.loss_good == 0.01));
}

TEST_CASE("what is no loss process is refused with the text in quotes") {
    for (const char* text : {"",
                             "bernoulli",
                             "bernoulli:",
                             "bernoulli:x",
                             "bernoulli:0.5x",
                             "bernoulli:0.5,0.5",
                             "bernoulli: 0.5",
                             "bernoulli:1.1",
                             "bernoulli:-0.1",
                             "bernoulli:nan",
                             "bernoulli:inf",
                             "bernoulli:0x1",
                             "Bernoulli:0.5",
                             "gilbert:",
                             "gilbert:0.5",
                             "gilbert:0.5,",
                             "gilbert:,0.5",
                             "gilbert:0.1,0.2,0.3,0.4,0.5",
                             "gilbert:0.1,0.2,0.3,",
                             "gilbert:0.1,2",
                             "gilbert:0.1,0.2,-1",
                             "gilbert:0.1;0.2",
                             "trace:file",
                             "uniform:0.5",
                             "0.5",
                             ":",
                             ":0.5"}) {
        CAPTURE(text);
        const std::string line = refusal_of_loss(text);
        REQUIRE(line.starts_with(std::string("'").append(text).append("': ")));
        CHECK(line.find('\n') == std::string::npos);
    }
}

TEST_CASE("a trace is zeros and ones between blanks and comments") {
    CHECK(parse_trace("0 1\t1\r\n# 111\n0#1\n\n1").lost ==
          std::vector<bool>{false, true, true, false, true});
    CHECK(parse_trace("1").lost == std::vector<bool>{true});
}

TEST_CASE("what is no trace is refused with the line's number") {
    CHECK_THROWS_WITH(parse_trace("01\n0 2\n"), Catch::Contains("line 2"));
    CHECK_THROWS_AS(parse_trace(""), std::invalid_argument);
    CHECK_THROWS_AS(parse_trace(" \n# only words\n"), std::invalid_argument);
    CHECK_THROWS_AS(parse_trace("lost"), std::invalid_argument);
    CHECK_THROWS_AS(parse_trace(std::string("0\0", 2)), std::invalid_argument);
    CHECK_THROWS_AS(parse_trace("0,1"), std::invalid_argument);
    CHECK_THROWS_AS(parse_trace("\xef\xbb\xbf"
                                "01"),
                    std::invalid_argument);
}
