// tests/protocol/description_test.cpp
#include "protocol/description.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "protocol/datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using ellicast::common::Random;
using Fault = std::optional<WireError>;

void put_text(Bytes& body, std::string_view text) {
    put_u8(body, static_cast<std::uint8_t>(text.size()));
    body.insert(body.end(), text.begin(), text.end());
}

/// A body with this name and this first coordinate of the origin.
Bytes body_with(std::string_view name, double x = 0.0) {
    Bytes body;
    for (const double value : {x, 1.0, -1.0}) put_f64(body, value);
    for (const std::string_view text :
         {name, std::string_view("mm"), std::string_view(), std::string_view("0.1.0")}) {
        put_text(body, text);
    }
    return body;
}

Fault with_body(const Bytes& body) {
    Bytes section;
    put_u8(section, 3);
    put_u16(section, static_cast<std::uint16_t>(body.size()));
    section.insert(section.end(), body.begin(), body.end());
    return refusal_of(datagram_with(section));
}

}  // namespace

TEST_CASE("a description cut short or one byte longer is a bad description") {
    const Bytes body = body_with("horse");
    REQUIRE_FALSE(with_body(body));
    for (std::size_t size = 0; size < body.size(); ++size) {
        CAPTURE(size);
        const Bytes cut(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(size));
        REQUIRE(with_body(cut) == WireError::bad_description);
    }
    Bytes longer = body;
    longer.push_back(0);
    CHECK(with_body(longer) == WireError::bad_description);
}

TEST_CASE("an origin that is not finite or absurdly far is a bad description") {
    CHECK(with_body(body_with("a", std::numeric_limits<double>::quiet_NaN())) ==
          WireError::bad_description);
    CHECK(with_body(body_with("a", std::numeric_limits<double>::infinity())) ==
          WireError::bad_description);
    CHECK(with_body(body_with("a", -1.1e30)) == WireError::bad_description);
    CHECK_FALSE(with_body(body_with("a", -1e30)));
}

TEST_CASE("control characters make a bad description") {
    for (int c = 0; c < 128; ++c) {
        CAPTURE(c);
        const bool control = c < 32 || c == 127;
        const std::string name = std::string("a") + static_cast<char>(c);
        CHECK(with_body(body_with(name)) ==
              (control ? Fault{WireError::bad_description} : Fault{}));
    }
    CHECK(with_body(body_with("\u0080")) == WireError::bad_description);
    CHECK(with_body(body_with("\u009f")) == WireError::bad_description);
    CHECK_FALSE(with_body(body_with("\u00a0")));
}

TEST_CASE("what is not UTF-8 makes a bad description") {
    for (const char* text : {"\x80", "\xc3", "\xc3(", "\xc0\xaf", "\xc1\xbf", "\xe0\x80\xaf",
                             "\xed\xa0\x80", "\xed\xbf\xbf", "\xf0\x80\x80\x80", "\xf4\x90\x80\x80",
                             "\xf8\x88\x80\x80\x80", "\xff", "\xe4\xb8", "\xf0\x9f\x90"}) {
        CHECK(with_body(body_with(text)) == WireError::bad_description);
        CHECK_FALSE(is_presentable(text));
    }
    for (const char* text :
         {"", "\u00e9", "\u0800", "\ud7ff", "\ue000", "\uffff", "\U00010000", "\U0010ffff"}) {
        CHECK_FALSE(with_body(body_with(text)));
    }
}

TEST_CASE("a string of 255 bytes goes through, a longer one is cut at a character") {
    const std::string most(255, 'x');
    CHECK(presentable(most) == most);
    CHECK(presentable(most + "y") == most);
    const std::string border = std::string(254, 'x') + "\u00e9";  // its second byte is the 256th
    CHECK(presentable(border) == std::string(254, 'x'));
    CHECK_FALSE(with_body(body_with(most)));
}

TEST_CASE("the writer makes any text presentable") {
    CHECK(presentable("a\nb\tc\x7f") == "a_b_c_");
    CHECK(presentable("\u0085x") == "_x");
    CHECK(presentable("caf\xe9") == "caf_");
    CHECK(presentable("\xed\xa0\x80") == "___");
    Random random(5);
    for (int round = 0; round < 20'000; ++round) {
        CAPTURE(round);
        std::string text(random.below(400), ' ');
        for (char& c : text) c = static_cast<char>(random.next());
        const std::string shown = presentable(text);
        REQUIRE(is_presentable(shown));
        REQUIRE(shown.size() <= 255);
        REQUIRE(presentable(shown) == shown);
    }
}

TEST_CASE("a description of nasty texts arrives presentable") {
    DatagramWriter writer(sample_header(), kDefaultDatagramBytes);
    REQUIRE(
        writer.add_description({"../\x1b[31m", {1, 2, 3}, "\xff", "\n", std::string(300, 'v')}));
    const Bytes bytes = writer.finish();
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    const Description read = view->sections()[0].description();
    CHECK(read == Description{"../_[31m", {1, 2, 3}, "_", "_", std::string(255, 'v')});
}
