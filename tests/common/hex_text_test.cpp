// tests/common/hex_text_test.cpp
#include "common/hex_text.hpp"

#include <catch2/catch.hpp>

namespace {

using namespace ellicast::common;

}  // namespace

TEST_CASE("every byte goes to two lower-case digits and back, from digits of either case") {
    std::array<std::uint8_t, 256> all{};
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<std::uint8_t>(k);
    std::string text = hex_text(all);
    CHECK(text.substr(0, 6) == "000102");
    CHECK(text.substr(510) == "ff");
    CHECK(bytes_of_hex<256>(text) == all);
    for (char& c : text) c = c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
    CHECK(bytes_of_hex<256>(text) == all);
    CHECK(hex_text({}).empty());
}

TEST_CASE("another number of digits, or anything else among them, is no bytes") {
    CHECK(bytes_of_hex<2>("0aF9") == std::array<std::uint8_t, 2>{0x0a, 0xf9});
    for (const char* text :
         {"", "0aF", "0aF90", "0aF900", "0xF9", "0aFg", " aF9", "0aF@", "0aF`"}) {
        CAPTURE(text);
        CHECK_FALSE(bytes_of_hex<2>(text));
    }
}
