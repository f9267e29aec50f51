// tests/support/comparison_table_test.cpp
#include "tests/support/comparison_table.hpp"

#include <catch2/catch.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

using namespace ellicast::tests;

namespace {

ComparisonRow row_of(const std::string& model, const std::string& method, double loss,
                     unsigned seed, double rms) {
    ComparisonRow row;
    row.model = model;
    row.method = method;
    row.loss = loss;
    row.seed = seed;
    row.rms = rms;
    row.max = 10 * rms;
    row.topology_right = row.closed = row.manifold = true;
    row.components = 1;
    row.bytes = row.stream_bytes = 12'345;
    row.self_intersecting_faces = 4;
    return row;
}

std::vector<ComparisonRow> some_rows() {
    std::vector<ComparisonRow> rows;
    for (unsigned seed = 1; seed <= 3; ++seed) {
        rows.push_back(row_of("cow", "ours", 0.5, seed, 1e-4 * seed));
        rows.push_back(row_of("cow", "floor", 0.5, seed, 4e-4));
        rows.push_back(row_of("ant", "ours", 0.5, seed, 8e-4));
        rows.push_back(row_of("ant", "floor", 0.5, seed, 1e-4));
        rows.push_back(row_of("cow", "code", 0.5, seed, ComparisonRow::kNone));
    }
    rows[0].topology_right = false;
    return rows;
}

std::string markdown_of(const std::vector<ComparisonRow>& rows) {
    std::ostringstream out;
    write_markdown(out, medians_of(rows));
    return out.str();
}

}  // namespace

TEST_CASE("a comparison read back is the one written") {
    std::stringstream csv;
    write_csv_header(csv);
    for (const ComparisonRow& row : some_rows()) write_csv(csv, row);
    const std::string text = csv.str();
    std::stringstream again;
    write_csv_header(again);
    for (const ComparisonRow& row : read_csv(csv)) write_csv(again, row);
    CHECK(again.str() == text);
    CHECK(text.find(",nan,") != std::string::npos);
}

TEST_CASE("what is no comparison is refused") {
    std::stringstream other("a,b\n1,2\n");
    CHECK_THROWS_AS(read_csv(other), std::runtime_error);
    std::stringstream header;
    write_csv_header(header);
    for (const char* line : {"cow", "cow,ours,x", "cow,ours,0.5,1,1,2,3"}) {
        std::stringstream csv(header.str() + line + "\n");
        CHECK_THROWS_AS(read_csv(csv), std::runtime_error);
    }
    std::stringstream longer;
    write_csv_header(longer);
    write_csv(longer, some_rows()[0]);
    std::string text = longer.str();
    text.insert(text.size() - 1, ",1");
    std::stringstream csv(text);
    CHECK_THROWS_AS(read_csv(csv), std::runtime_error);
}

TEST_CASE("medians are over the seeds and stand beside the floor") {
    const auto medians = medians_of(some_rows());
    REQUIRE(medians.size() == 5);
    CHECK(medians[0].method == "ours");
    CHECK(medians[0].runs == 3);
    CHECK(medians[0].right == 2);
    CHECK(medians[0].rms == Approx(2e-4));
    CHECK(medians[0].rms_least == Approx(1e-4));
    CHECK(medians[0].rms_largest == Approx(3e-4));
    CHECK(medians[0].to_floor == Approx(0.5));
    CHECK(medians[0].max_to_floor == Approx(0.5));
    CHECK(medians[2].to_floor == Approx(8));
    CHECK(medians[4].surfaces == 0);
    CHECK_FALSE(medians[4].rms == medians[4].rms);
}

TEST_CASE("half the runs without a surface are no result, and an exact floor is no measure") {
    std::vector<ComparisonRow> rows;
    for (unsigned seed = 1; seed <= 4; ++seed) {
        const bool whole = seed <= 2;
        rows.push_back(row_of("cow", "code", 0.5, seed, whole ? 1e-5 : ComparisonRow::kNone));
        rows.push_back(row_of("cow", "floor", 0.5, seed, 1e-17));
    }
    auto medians = medians_of(rows);
    CHECK(medians[0].surfaces == 2);
    CHECK_FALSE(medians[0].rms == medians[0].rms);
    CHECK(medians[0].rms_largest == Approx(1e-5));
    rows[4].rms = 1e-5;
    medians = medians_of(rows);
    CHECK(medians[0].rms == Approx(1e-5));
    CHECK_FALSE(medians[0].to_floor == medians[0].to_floor);
}

TEST_CASE("the Markdown says rms, wrong topology, nothing, and the geometric mean") {
    const std::string text = markdown_of(some_rows());
    CHECK(text.find("| model | method | 50 % |\n| --- | --- | --- |\n") != std::string::npos);
    CHECK(text.find("| cow | ours | 2.0 (2/3) |") != std::string::npos);
    CHECK(text.find("| cow | floor | 4.0 |") != std::string::npos);
    CHECK(text.find("| cow | code | nothing |") != std::string::npos);
    CHECK(text.find("| ours | 2.00 (8.00) |") != std::string::npos);  // of 0.5 and 8
    CHECK(text.find("| ours | 5/6 |") != std::string::npos);
    CHECK(text.find("| ant | code |") == std::string::npos);
    CHECK(text.find("12345") != std::string::npos);
}

TEST_CASE("the anytime table has the shares sent as columns, the whole among them") {
    std::vector<ComparisonRow> rows;
    for (const double sent : {0.1, 1.0}) {
        rows.push_back(row_of("cow", "ours", 0, 1, 1e-4 / sent));
        rows.back().sent = sent;
    }
    const std::string text = markdown_of(rows);
    CHECK(text.find("| model | method | 10 % | 100 % |") != std::string::npos);
    CHECK(text.find("| cow | ours | 10 | 1.0 |") != std::string::npos);
}
