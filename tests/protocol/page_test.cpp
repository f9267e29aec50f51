// tests/protocol/page_test.cpp
#include "protocol/page.hpp"

#include <catch2/catch.hpp>

#include "protocol/datagram.hpp"
#include "tests/protocol/golden_datagram.hpp"
#include "tests/protocol/wire_samples.hpp"

namespace {

using namespace ellicast::protocol;
using namespace ellicast::tests;
using Fault = std::optional<WireError>;

constexpr std::size_t kNameLengthAt = 30;  // in the body

Fault with_body(const Bytes& body) {
    Bytes section;
    put_u8(section, 4);
    put_u16(section, static_cast<std::uint16_t>(body.size()));
    section.insert(section.end(), body.begin(), body.end());
    return refusal_of(datagram_with(section));
}

Fault with_byte(std::size_t place, std::uint8_t value) {
    Bytes body = encode_page(golden_page());
    body.at(place) = value;
    return with_body(body);
}

}  // namespace

TEST_CASE("a page has the golden bytes") {
    DatagramWriter writer(golden_header(), kMinDatagramBytes);
    REQUIRE(writer.add_page(golden_page()));
    const Bytes bytes = writer.finish();
    const Bytes section(bytes.begin() + kHeaderBytes, bytes.end() - kTrailerBytes);
    CHECK(section == from_hex(kGoldenPageHex));
    const auto view = parse_datagram(bytes);
    REQUIRE(view);
    REQUIRE(view->sections().size() == 1);
    REQUIRE(view->sections()[0].kind == SectionKind::page);
    CHECK(view->sections()[0].page() == golden_page());
}

TEST_CASE("a page cut short or one byte longer is a bad description") {
    const Bytes body = encode_page(golden_page());
    REQUIRE_FALSE(with_body(body));
    for (std::size_t size = 0; size < body.size(); ++size) {
        CAPTURE(size);
        const Bytes cut(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(size));
        REQUIRE(with_body(cut) == WireError::bad_description);
    }
    Bytes longer = body;
    longer.push_back('x');
    CHECK(with_body(longer) == WireError::bad_description);
}

TEST_CASE("a page with numbers that cannot be is a bad description") {
    REQUIRE_FALSE(with_byte(3, 2));                         // page 1 of 2
    CHECK(with_byte(3, 1) == WireError::bad_description);   // page 1 of 1
    CHECK(with_byte(7, 0) == WireError::bad_description);   // version 0
    CHECK(with_byte(19, 0) == WireError::bad_description);  // no component
    CHECK(with_byte(16, 1) == WireError::bad_description);  // 2^24 of them
    CHECK(with_byte(23, 3) == WireError::bad_description);  // an odd Euler characteristic
    CHECK(with_byte(kNameLengthAt + 1, '\n') == WireError::bad_description);
    CHECK(with_byte(kNameLengthAt + 1, 0xff) == WireError::bad_description);
}

TEST_CASE("a long name is cut at a character's border, and a longer one refused") {
    PageEntry entry = golden_page();
    entry.name = std::string(47, 'n') + "\u00e9";
    Bytes body = encode_page(entry);
    CHECK(decode_page(body).name == std::string(47, 'n'));
    body[kNameLengthAt] = 49;
    body.push_back('n');
    body.push_back('n');
    CHECK(with_body(body) == WireError::bad_description);
    body[kNameLengthAt] = 48;
    body.pop_back();
    CHECK_FALSE(with_body(body));
}

TEST_CASE("a page that does not fit is left out") {
    DatagramWriter writer(golden_header(), kMinDatagramBytes);
    std::vector<VertexRecord> vertices(writer.vertices_that_fit());
    writer.add_vertices(0, 1, vertices);
    CHECK_FALSE(writer.add_page(golden_page()));
}
