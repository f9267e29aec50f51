// tests/sender/page_names_test.cpp
#include "sender/page_names.hpp"

#include <catch2/catch.hpp>

using ellicast::sender::page_names;
using Names = std::vector<std::string>;

TEST_CASE("pages are called after their files, and all differ") {
    CHECK(page_names({"x/a.ply", "b.obj"}) == Names{"a", "b"});
    CHECK(page_names({"x/a.ply", "y/a.ply", "a.stl"}) == Names{"a", "a-2", "a-3"});
    // A number never takes the name of a file that comes later.
    CHECK(page_names({"a.ply", "y/a.ply", "a-2.ply"}) == Names{"a", "a-3", "a-2"});
    CHECK(page_names({"a-2.ply", "a.ply", "y/a.ply", "z/a-2.ply"}) ==
          Names{"a-2", "a", "a-3", "a-2-2"});
}
