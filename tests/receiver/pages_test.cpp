// tests/receiver/pages_test.cpp
#include "receiver/pages.hpp"

#include <catch2/catch.hpp>
#include <chrono>

#include "common/hex_text.hpp"
#include "common/random.hpp"
#include "receiver/page_files.hpp"
#include "receiver/page_list.hpp"
#include "receiver/session.hpp"
#include "tests/support/datagrams.hpp"

using namespace ellicast;
using namespace ellicast::receiver;
using namespace std::chrono_literals;
using tests::Datagram;
using tests::MadeObject;
using tests::MadeStream;
using Names = std::vector<std::string>;

namespace {

Source source_at(std::uint8_t host) {
    Source source;
    source.address[15] = host;
    source.port = 4000;
    return source;
}

MadeObject object_named(const std::string& name, std::uint64_t seed, std::uint32_t vertices = 700) {
    MadeObject object = tests::made_sphere(vertices, 25, seed);
    object.description.name = name;
    return object;
}

protocol::PageEntry entry_of(const MadeObject& object, std::uint16_t page, std::uint16_t pages,
                             std::uint32_t version = 1) {
    protocol::PageEntry entry;
    entry.page = page;
    entry.pages = pages;
    entry.version = version;
    entry.object = object.id;
    entry.ellipsoids = object.hint.ellipsoids;
    entry.vertices = object.hint.vertices;
    entry.name = object.description.name;
    return entry;
}

/// A carousel as a sender sends it: in each round every page, told by a datagram of one line, whose
/// turn it is.
class Carousel {
  public:
    explicit Carousel(std::vector<MadeObject> objects, std::uint32_t rounds = 0,
                      std::uint8_t session = 1)
        : objects_(std::move(objects)), versions_(objects_.size(), 1) {
        stream_.rounds = rounds;
        stream_.session[0] = session;
    }

    std::vector<Datagram> round() {
        std::vector<Datagram> all;
        for (std::size_t page = 0; page < objects_.size(); ++page) {
            protocol::DatagramHeader header = tests::made_header(objects_[page], stream_);
            // One round of many, then numbered as this one.
            MadeStream once = stream_;
            once.rounds = 0;
            auto datagrams = tests::made_datagrams(objects_[page], once, 1);
            header.datagrams = static_cast<std::uint32_t>(datagrams.size());
            for (std::size_t k = 0; k < datagrams.size(); ++k) {
                renumber(datagrams[k]);
                if (k % 4 == 0) all.push_back(line(header, k, turn_++ % objects_.size()));
                all.push_back(datagrams[k]);
            }
        }
        ++round_;
        return all;
    }
    void replace(std::size_t page, MadeObject object) {
        objects_[page] = std::move(object);
        ++versions_[page];
    }
    [[nodiscard]] const MadeObject& object(std::size_t page) const { return objects_[page]; }

  private:
    void renumber(Datagram& datagram) {
        // WIRE_FORMAT.md: round at 73, rounds at 77.
        for (std::size_t k = 0; k < 4; ++k) {
            datagram[73 + k] = static_cast<std::uint8_t>(round_ >> (8 * (3 - k)));
            datagram[77 + k] = static_cast<std::uint8_t>(stream_.rounds >> (8 * (3 - k)));
        }
        protocol::stamp(datagram, sequence_++, 0);
    }
    Datagram line(protocol::DatagramHeader header, std::size_t ordinal, std::size_t told) {
        header.round = round_;
        header.ordinal = static_cast<std::uint32_t>(ordinal);
        header.rtp.sequence = sequence_++;
        protocol::DatagramWriter writer(header, protocol::kDefaultDatagramBytes);
        REQUIRE(writer.add_page(entry_of(objects_[told], static_cast<std::uint16_t>(told),
                                         static_cast<std::uint16_t>(objects_.size()),
                                         versions_[told])));
        return writer.finish();
    }

    std::vector<MadeObject> objects_;
    std::vector<std::uint32_t> versions_;
    MadeStream stream_;
    std::uint32_t round_ = 0;
    std::uint16_t sequence_ = 65'000;
    std::size_t turn_ = 0;
};

Carousel three(std::uint32_t rounds = 0) {
    return Carousel({object_named("ann", 1), object_named("bob", 2), object_named("cy", 3)},
                    rounds);
}

SessionOptions all_pages(Until until = Until::end, Names wanted = {}) {
    SessionOptions options;
    options.until = until;
    options.pages.all = true;
    options.pages.wanted = std::move(wanted);
    return options;
}

/// A session and its clock; every datagram takes a millisecond.
struct Run {
    explicit Run(const SessionOptions& options) : session(options, 0s) {}

    void receive(const Datagram& datagram, std::uint8_t host = 1) {
        if (session.finished()) return;
        session.on_datagram(now, source_at(host), datagram);
        ++taken;
        pass(1ms);
    }
    void receive(const std::vector<Datagram>& datagrams, std::uint8_t host = 1) {
        for (const Datagram& datagram : datagrams) receive(datagram, host);
    }
    void pass(Time duration) {
        const Time until = now + duration;
        for (auto next = session.next_wakeup(); next && *next <= until;
             next = session.next_wakeup()) {
            now = std::max(now, *next);
            session.poll(now);
        }
        now = until;
        if (!session.finished()) session.poll(now);
    }
    [[nodiscard]] Names names() const {
        Names all;
        for (const Page& page : session.pages()) all.push_back(page.name);
        return all;
    }

    Session session;
    Time now = 1s;
    std::size_t taken = 0;
};

}  // namespace

TEST_CASE("a carousel is received until all of its pages are complete") {
    Run run(all_pages());
    Carousel carousel = three();
    run.receive(carousel.round());
    CHECK(run.session.ends_by() == EndReason::complete);
    Names names = run.names();
    std::sort(names.begin(), names.end());
    CHECK(names == Names{"ann", "bob", "cy"});
    for (const Page& page : run.session.pages()) CHECK(page.best().complete());
    CHECK(run.session.summary(run.now).other_groups == 0);
}

TEST_CASE("one page, or some, are chosen by name or id, and end reception when they are complete") {
    Carousel carousel = three();
    const std::string id = common::hex_text(carousel.object(1).id);
    SECTION("by name") {
        Run run(all_pages(Until::end, {"bob"}));
        run.receive(carousel.round());
        CHECK(run.session.ends_by() == EndReason::complete);
        CHECK(run.names() == Names{"bob"});
        CHECK(run.taken < carousel.round().size());
    }
    SECTION("by id, in either case") {
        std::string upper = id;
        for (char& c : upper) c = static_cast<char>(std::toupper(c));
        for (const std::string& wanted : {id, upper}) {
            Run run(all_pages(Until::end, {wanted, "ann"}));
            run.receive(carousel.round());
            CHECK(run.session.ends_by() == EndReason::complete);
            Names names = run.names();
            std::sort(names.begin(), names.end());
            CHECK(names == Names{"ann", "bob"});
        }
    }
    SECTION("into one file") {
        SessionOptions options = all_pages(Until::end, {"cy"});
        options.pages.all = false;
        Run run(options);
        run.receive(carousel.round());
        CHECK(run.session.ends_by() == EndReason::complete);
        CHECK(run.session.shown()->object == carousel.object(2).id);
    }
    SECTION("one that never comes: until silence") {
        Run run(all_pages(Until::end, {"bob", "dora"}));
        run.receive(carousel.round());
        CHECK_FALSE(run.session.finished());
        run.pass(3s);
        CHECK(run.session.ends_by() == EndReason::idle);
        CHECK(run.names() == Names{"bob"});
    }
    SECTION("none that ever comes: until silence, with nothing") {
        Run run(all_pages(Until::end, {"dora"}));
        run.receive(carousel.round());
        run.pass(3s);
        CHECK(run.session.ends_by() == EndReason::idle);
        CHECK(run.session.shown() == nullptr);
    }
}

TEST_CASE("a finite carousel ends with its last page, with one more round to bring what was lost") {
    const std::uint64_t seed = GENERATE(1u, 2u, 3u);
    common::Random random(seed);
    Run run(all_pages());
    Carousel carousel = three(2);
    for (int round = 0; round < 2; ++round) {
        const auto datagrams = carousel.round();
        for (std::size_t k = 0; k < datagrams.size(); ++k) {
            const bool last = k + 1 == datagrams.size();
            if (last || !random.chance(0.4)) run.receive(datagrams[k]);
            if (round == 0) CHECK_FALSE(run.session.finished());
        }
    }
    run.pass(300ms);
    CHECK(run.session.finished());
    CHECK(run.session.ends_by() == EndReason::stream_end);
    CHECK(run.session.pages().size() == 3);
}

TEST_CASE("option --until round ends after a round of all pages that was heard from its start") {
    Run run(all_pages(Until::round));
    Carousel carousel = three();
    const auto lossy = [](std::vector<Datagram> datagrams) {
        std::vector<Datagram> rest;
        for (std::size_t k = 0; k < datagrams.size(); ++k) {
            if (k % 7 != 3) rest.push_back(datagrams[k]);
        }
        return rest;
    };
    // Joined within the second page.
    auto first = lossy(carousel.round());
    first.erase(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(first.size() / 2));
    run.receive(first);
    run.pass(300ms);
    CHECK_FALSE(run.session.finished());
    run.receive(lossy(carousel.round()));
    run.receive(lossy(carousel.round()));
    run.pass(400ms);
    CHECK((run.session.ends_by() == EndReason::round ||
           run.session.ends_by() == EndReason::complete));
    CHECK(run.session.pages().size() == 3);
}

TEST_CASE("a page that changes keeps its name, and its old version until the new one has a shape") {
    Run run(all_pages(Until::forever));
    Carousel carousel = three();
    run.receive(carousel.round());
    const protocol::ObjectId before = carousel.object(1).id;
    carousel.replace(1, object_named("bob", 9));
    const protocol::ObjectId after = carousel.object(1).id;
    bool switched = false;
    for (const Datagram& datagram : carousel.round()) {
        run.receive(datagram);
        for (const Page& page : run.session.pages()) {
            if (page.name != "bob") continue;
            const RecordStore::Group& best = page.best();
            if (best.object == after) {
                switched = true;
                CHECK(2 * best.ellipsoids.size() >= best.hint.ellipsoids);
            } else {
                CHECK(best.object == before);
                CHECK_FALSE(switched);
                CHECK(best.complete());
            }
        }
    }
    CHECK(switched);
    for (const Page& page : run.session.pages()) {
        CHECK(page.versions.size() == 1);
        CHECK(page.version == (page.name == "bob" ? 2 : 1));
    }
    CHECK(run.session.store().groups().size() == 3);

    SECTION("a late datagram of the old version changes nothing") {
        MadeStream stream;
        stream.rounds = 0;
        stream.session[0] = 1;
        run.receive(tests::made_datagrams(object_named("bob", 2), stream)[3]);
        for (const Page& page : run.session.pages()) {
            if (page.name == "bob") CHECK(page.best().object == after);
        }
    }
}

TEST_CASE("a new version whose line was lost is kept until the line comes") {
    Run run(all_pages(Until::forever));
    Carousel carousel = three();
    run.receive(carousel.round());
    const MadeObject next = object_named("bob", 9);
    MadeStream stream;
    stream.rounds = 0;
    stream.session[0] = 1;
    run.receive(tests::made_datagrams(next, stream));
    const auto bob = [&] {
        const std::vector<Page> pages = run.session.pages();
        return *std::find_if(pages.begin(), pages.end(),
                             [](const Page& page) { return page.name == "bob"; });
    };
    CHECK(bob().versions.size() == 2);
    CHECK(bob().best().object == carousel.object(1).id);
    protocol::DatagramWriter writer(tests::made_header(next, stream), 1200);
    REQUIRE(writer.add_page(entry_of(next, 1, 3, 2)));
    run.receive(writer.finish());
    CHECK(bob().best().object == next.id);
    CHECK(bob().best().complete());
    CHECK(bob().versions.size() == 1);

    SECTION("and one that was never listed goes when it was silent for long") {
        run.receive(tests::made_datagrams(object_named("bob", 10), stream)[0]);
        CHECK(bob().versions.size() == 2);
        run.pass(kForgotten);
        run.receive(tests::made_datagrams(next, stream)[0]);
        run.receive(tests::made_datagrams(object_named("new", 11), stream)[0]);
        CHECK(bob().versions.size() == 1);
    }
}

TEST_CASE("many changes leave no memory behind") {
    Run run(all_pages(Until::forever));
    Carousel carousel = three();
    run.receive(carousel.round());
    const std::size_t bytes = run.session.store().bytes();
    for (std::uint64_t change = 0; change < 30; ++change) {
        carousel.replace(change % 3, object_named(change % 3 == 0   ? "ann"
                                                  : change % 3 == 1 ? "bob"
                                                                    : "cy",
                                                  100 + change));
        run.receive(carousel.round());
        REQUIRE(run.session.store().groups().size() == 3);
        REQUIRE(run.session.store().bytes() == bytes);
    }
    CHECK(run.session.store().counts().evicted == 0);
}

TEST_CASE("another station's pages are strangers, whatever their names") {
    Run run(all_pages(Until::complete));
    Carousel ours = three();
    Carousel theirs({object_named("bob", 50, 400), object_named("eve", 51, 400)}, 0, 9);
    const auto a = ours.round();
    const auto b = theirs.round();
    for (std::size_t k = 0; k < a.size(); ++k) {
        if (k < b.size()) run.receive(b[k], 2);
        run.receive(a[k]);
    }
    CHECK(run.session.ends_by() == EndReason::complete);
    Names names = run.names();
    std::sort(names.begin(), names.end());
    CHECK(names == Names{"ann", "bob", "cy"});
    for (const Page& page : run.session.pages()) CHECK(page.best().sender.source == source_at(1));
    CHECK(run.session.summary(run.now).other_groups == 2);
}

TEST_CASE("a restarted sender's pages go on with what the first one sent") {
    Run run(all_pages(Until::complete));
    Carousel first = three();
    Carousel second({first.object(0), first.object(1), first.object(2)}, 0, 2);
    const auto a = first.round();
    const auto b = second.round();
    run.receive(
        std::vector<Datagram>(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(a.size() / 2)));
    run.pass(1500ms);
    run.receive(b);
    CHECK(run.session.ends_by() == EndReason::complete);
    CHECK(run.session.pages().size() == 3);
}

TEST_CASE("the contents are a function of the set of lines, and bounded") {
    const MadeObject object = object_named("x", 1, 50);
    std::vector<protocol::PageEntry> lines;
    for (std::uint16_t page = 0; page < 20; ++page) {
        for (std::uint32_t version = 1; version <= 3; ++version) {
            lines.push_back(entry_of(object, page, 20, version));
            lines.push_back(entry_of(object, page, 20, version));
            lines.back().name = "liar";
        }
    }
    std::optional<std::map<std::uint16_t, protocol::PageEntry>> expected;
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        common::Random random(seed);
        common::shuffle(lines, random);
        Catalogue catalogue(4, 20);
        SenderKey sender;
        for (const protocol::PageEntry& line : lines) {
            protocol::DatagramWriter writer(tests::made_header(object), 1200);
            REQUIRE(writer.add_page(line));
            const Datagram bytes = writer.finish();
            catalogue.on_datagram(1s, sender, *protocol::parse_datagram(bytes));
        }
        REQUIRE(catalogue.of(sender));
        CHECK(catalogue.of(sender)->complete());
        if (!expected) expected = catalogue.of(sender)->lines;
        CHECK(catalogue.of(sender)->lines == *expected);
    }
    Catalogue small(3, 5);
    for (std::uint16_t k = 0; k < 200; ++k) {
        SenderKey sender;
        sender.session[0] = static_cast<std::uint8_t>(k % 50);
        protocol::DatagramWriter writer(tests::made_header(object), 1200);
        REQUIRE(writer.add_page(entry_of(object, k, 1000)));
        const Datagram bytes = writer.finish();
        small.on_datagram(Time(k), sender, *protocol::parse_datagram(bytes));
        REQUIRE(small.all().size() <= 3);
        for (const Contents& contents : small.all()) REQUIRE(contents.lines.size() <= 5);
    }
}

TEST_CASE("what is on air is listed once every line was heard") {
    SessionOptions options = all_pages(Until::forever);
    Run run(options);
    Carousel carousel = three();
    CHECK_FALSE(lists_all(run.session));
    const auto datagrams = carousel.round();
    std::size_t needed = 0;
    for (const Datagram& datagram : datagrams) {
        run.receive(datagram);
        ++needed;
        if (lists_all(run.session)) break;
    }
    CHECK(needed < datagrams.size() / 2);  // before the last page's turn
    const std::vector<ListedPage> pages = listed_pages(run.session);
    REQUIRE(pages.size() == 3);
    CHECK(pages[2].name == "cy");
    CHECK(pages[2].object == carousel.object(2).id);
    CHECK(pages[2].vertices == 700);
    CHECK(pages[2].genus() == 0);
    // A station without contents is listed by its description.
    run.receive(tests::made_datagrams(object_named("alone", 40)), 7);
    CHECK(lists_all(run.session));
    CHECK(listed_pages(run.session).size() == 4);
    const std::string text = list_text(listed_pages(run.session));
    CHECK(text.find("alone") != std::string::npos);
    CHECK(std::count(text.begin(), text.end(), '\n') == 5);
}

TEST_CASE("files of pages are all different, and safe") {
    const auto stems = page_stems({"horse", "a/horse", "../horse", "Horse", "", "...", "x y"}, 100);
    CHECK(stems.at("Horse") == "Horse");  // smaller than "horse"
    CHECK(stems.at("horse").substr(0, 6) == "horse-");
    CHECK(page_stems({"a/b/horse", "horse"}, 100).at("horse") == "horse");
    CHECK(stems.at("x y") == "x_y");
    std::set<std::string> folded;
    for (const auto& [name, stem] : stems) {
        CHECK(stem.find('/') == std::string::npos);
        CHECK(stem.find('.') != 0);
        std::string lower = stem;
        for (char& c : lower) c = static_cast<char>(std::tolower(c));
        CHECK(folded.insert(lower).second);
        CHECK(stem.size() <= 110);
    }
    CHECK(folded.size() == 7);
    // The order in which names are given means nothing.
    CHECK(page_stems({"x y", "...", "", "Horse", "../horse", "a/horse", "horse"}, 100) == stems);
    CHECK(page_stems({std::string(300, 'n')}, 20).begin()->second == std::string(20, 'n'));
}
