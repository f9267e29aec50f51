// protocol/datagram.hpp
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/result.hpp"
#include "protocol/strided.hpp"

/// Bytes <-> structs of the ellicast wire. protocol/WIRE_FORMAT.md is the law; this header follows
/// it. No I/O, no clock, no mesh types. All numbers on the wire are big-endian.
namespace ellicast::protocol {

inline constexpr std::uint8_t kWireVersion = 1;
inline constexpr std::uint8_t kRtpPayloadType = 96;  // first dynamic type of RFC 3551
inline constexpr std::uint32_t kRtpClockHz = 90'000;
inline constexpr std::size_t kMinDatagramBytes = 576;
inline constexpr std::size_t kDefaultDatagramBytes = 1200;
inline constexpr std::size_t kMaxDatagramBytes = 65'507;  // largest UDP payload over IPv4
inline constexpr std::size_t kMaxSections = 8;            // per datagram
inline constexpr std::uint32_t kMaxEllipsoids = 65'535;
inline constexpr std::uint32_t kMaxVertices = 1u << 28;
inline constexpr std::uint32_t kMaxComponents = 1u << 20;

/// Bounds of plausible geometry. Sixth powers of lengths between kMinRadius * kMinDiagonal and
/// kMaxCoordinate stay within double, and the lengths themselves within float.
inline constexpr float kMaxCoordinate = 1e30f;
inline constexpr double kMinDiagonal = 1e-30;  // of the box
inline constexpr double kMinRadius = 1e-6;     // of an ellipsoid, in diagonals; the largest is 1
inline constexpr double kCenterSlack = 0.05;   // of a centre beyond the box, in diagonals

inline constexpr std::size_t kEllipsoidBytes = 36;
inline constexpr std::size_t kVertexBytes = 12;  // of the position; tags come on top
inline constexpr std::size_t kEdgeBytes = 8;
inline constexpr std::size_t kHeaderBytes = 89;         // RTP header, our header and hint
inline constexpr std::size_t kTrailerBytes = 4;         // CRC-32C
inline constexpr std::size_t kSectionHeaderBytes = 13;  // of a section of ellipsoids or vertices
inline constexpr std::size_t kEdgeSectionBytes = 9;     // in front of a section's edges
/// Of a writer: what sealing and signing leave of the smallest datagram (secured_datagram.hpp).
inline constexpr std::size_t kLeastCapacity = kMinDatagramBytes - 108;

using SessionId = std::array<std::uint8_t, 8>;
using ObjectId = std::array<std::uint8_t, 8>;

/// Centre, then the lower triangle of L row by row: cx cy cz l00 l10 l11 l20 l21 l22. Model units,
/// frame: the model's minus the description's origin.
struct EllipsoidRecord {
    std::array<float, 9> scalars{};
    bool operator==(const EllipsoidRecord&) const = default;
};

/// Position x y z; model units, frame as above. What the record format leaves out is zero.
struct VertexRecord {
    std::array<float, 3> position{};
    std::uint16_t normal = 0;              // octahedral code of RecordFormat::normal_bits bits
    std::uint16_t ring = 0;                // of the neighbours in the original mesh; 8 bits
    std::array<std::uint8_t, 3> colour{};  // red green blue
    std::uint8_t unused = 0;
    bool operator==(const VertexRecord&) const = default;
};

/// An edge a b of the mesh that is left of the original when vertices with index `among` and above
/// are collapsed; a < b < among. With among = Hint::vertices, one of the original itself.
struct EdgeRecord {
    std::uint32_t among = 0;
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    auto operator<=>(const EdgeRecord&) const = default;
};

/// What a vertex record holds beside its position.
struct RecordFormat {
    std::uint8_t normal_bits = 0;  // 0, 8, 12 or 16
    bool ring = false;
    bool colour = false;
    bool operator==(const RecordFormat&) const = default;

    /// The nibble on the wire: bits 0-1 the size of the normal, bit 2 ring, bit 3 colour. Requires
    /// is_known() (asserted).
    [[nodiscard]] std::uint8_t code() const;
    /// Of an unknown code: one that no acceptable hint has.
    static RecordFormat of_code(std::uint8_t code);
    [[nodiscard]] bool is_known() const;

    /// Bits of one vertex's normal and ring.
    [[nodiscard]] std::size_t tag_bits() const { return normal_bits + (ring ? kRingBits : 0); }
    /// Bytes that the records of `count` vertices take in one section. Of two sections together it
    /// may be one more than of one with as many vertices.
    [[nodiscard]] std::size_t vertex_bytes(std::size_t count) const {
        return count * (kVertexBytes + (colour ? kColourBytes : 0)) + (count * tag_bits() + 7) / 8;
    }
    /// The most vertices whose records take at most so many bytes in one section.
    [[nodiscard]] std::size_t vertices_within(std::size_t bytes) const {
        // All but the tags are whole bytes, so that rounding the tags up never takes one too many.
        return 8 * bytes / (8 * (kVertexBytes + (colour ? kColourBytes : 0)) + tag_bits());
    }

    static constexpr std::size_t kRingBits = 8;
    static constexpr std::size_t kColourBytes = 3;
};

/// WIRE_FORMAT.md section 4.3 says what they are.
inline constexpr std::uint8_t kDiagonalRules = 6;

/// What every datagram says of the whole object; enough to rebuild it and to check the result.
/// Topology is that of the boundary of the union of the solid.
struct Hint {
    std::array<float, 3> box_min{};
    std::array<float, 3> box_max{};
    std::uint32_t components = 1;    // connected surfaces
    std::int32_t euler_all = 2;      // V - E + F over all components
    std::int32_t euler_largest = 2;  // of the component with the largest volume
    std::uint16_t ellipsoids = 0;    // distinct records in the object
    std::uint32_t vertices = 0;      // distinct records in the object
    RecordFormat format;
    std::uint8_t diagonals = 0;  // below kDiagonalRules: how the mesh was triangulated
    bool by_importance = false;  // the vertices' order; else any that is spread evenly
    bool approximate = false;  // the promise is not to be judged (overlapping parts, inner shells)
    bool operator==(const Hint&) const = default;
};

struct RtpHeader {
    bool marker = false;  // ends a round; for RTP tools only
    std::uint8_t payload_type = kRtpPayloadType;
    std::uint16_t sequence = 0;
    std::uint32_t timestamp = 0;  // 90 kHz, of sending
    std::uint32_t ssrc = 0;
    bool operator==(const RtpHeader&) const = default;
};

struct DatagramHeader {
    RtpHeader rtp;
    SessionId session{};
    ObjectId object{};
    Hint hint;
    std::uint32_t round = 0;      // from 0
    std::uint32_t rounds = 1;     // in all; 0 = forever
    std::uint32_t ordinal = 0;    // of this datagram in its round, from 0
    std::uint32_t datagrams = 1;  // in this round
    bool operator==(const DatagramHeader&) const = default;
};

enum class SectionKind : std::uint8_t {
    ellipsoids = 1,
    vertices = 2,
    description = 3,
    page = 4,
    edges = 5
};

/// What is worth knowing but not needed to rebuild. Strings are UTF-8 without control characters,
/// at most 255 bytes each.
struct Description {
    std::string name;                // file stem or what the user gave; not a path
    std::array<double, 3> origin{};  // add to every position
    std::string unit;                // "" unknown
    std::string certificate;         // "" none
    std::string sender_version;
    bool operator==(const Description&) const = default;
};

/// A line of a carousel's table of contents. Any datagram may carry that of any page, so that one
/// learns soon what is on air.
struct PageEntry {
    std::uint16_t page = 0;     // its place in the carousel, from 0
    std::uint16_t pages = 1;    // in the carousel
    std::uint32_t version = 1;  // of the page in this session: plus one whenever its object changes
    ObjectId object{};          // that is sent as this page now
    std::uint32_t components = 1;  // this and the next three as in the object's hint
    std::int32_t euler_all = 2;
    std::uint16_t ellipsoids = 0;
    std::uint32_t vertices = 0;
    std::string name;  // the description's, cut to kMaxPageNameBytes
    bool operator==(const PageEntry&) const = default;
};
inline constexpr std::size_t kMaxPageNameBytes = 48;

/// Why a datagram was dropped. Each is counted apart by the receiver; to_string gives the report's
/// key.
enum class WireError : std::uint8_t {
    too_short,           // fewer bytes than header and trailer
    not_rtp,             // RTP version is not 2, or padding, an extension or sources are announced
    unknown_version,     // our version byte is another
    unsupported_flags,   // an unknown flag is set; of parse_datagram: sealed or signed, too
    bad_checksum,        // CRC-32C differs
    bad_hint,            // box not finite or empty, counts over the limits, impossible topology
    bad_round,           // ordinal or round outside what the same header says there is
    bad_section,         // past the end, length against count, no record; none, over kMaxSections
    index_out_of_range,  // a record's index is not below the hinted count, or stride is 0; ends of
                         // an edge that do not ascend
    bad_record,          // not finite, outside the hinted box (5 % slack for centres), bad radius
    bad_description,     // or page: lengths that miss the end, control characters, no UTF-8, bad
                         // numbers
    kCount
};
std::string_view to_string(WireError error);

/// A validated section. Records are decoded on access, from the caller's bytes.
struct SectionView {
    SectionKind kind{};
    RecordFormat format;       // of vertices
    std::uint32_t first = 0;   // index of record 0
    std::uint32_t stride = 1;  // record k has index first + k * stride
    std::uint32_t among = 0;   // of edges
    std::uint16_t count = 0;
    std::span<const std::uint8_t> body;  // records, or the description's or page's bytes

    /// Requires k < count.
    [[nodiscard]] std::uint32_t index(std::size_t k) const {
        return first + static_cast<std::uint32_t>(k) * stride;
    }
    /// Requires the kind and k < count (asserted).
    [[nodiscard]] EllipsoidRecord ellipsoid(std::size_t k) const;
    [[nodiscard]] VertexRecord vertex(std::size_t k) const;
    [[nodiscard]] EdgeRecord edge(std::size_t k) const;
    [[nodiscard]] Description description() const;
    [[nodiscard]] PageEntry page() const;

    /// Decodes records k, k + 1, ... until `out` is full; many at once are cheaper. Requires the
    /// kind and k + out.size() <= count (asserted).
    void read(std::size_t k, std::span<EllipsoidRecord> out) const;
    void read(std::size_t k, std::span<VertexRecord> out) const;
};

/// A datagram whose every byte was checked; refers to the bytes it was parsed from. Sections of
/// unknown kinds are left out.
struct DatagramView {
    DatagramHeader header;
    std::array<SectionView, kMaxSections> section_storage;
    std::size_t section_count = 0;
    [[nodiscard]] std::span<const SectionView> sections() const {
        return {section_storage.data(), section_count};
    }
};

/// Checks everything of a clear datagram that can be checked without state: see WireError for what,
/// WIRE_FORMAT.md for the bounds. secured_datagram.hpp makes clear ones of the others. Never
/// allocates, never throws; linear in the bytes.
Result<DatagramView, WireError> parse_datagram(std::span<const std::uint8_t> bytes);

/// Bytes of the hint (with its approximate flag) in canonical form, as the object id and the
/// receiver's grouping hash them.
inline constexpr std::size_t kCanonicalHintBytes = 44;
std::array<std::uint8_t, kCanonicalHintBytes> canonical_bytes(const Hint& hint);

/// True when parse_datagram would not refuse the hint as bad_hint.
bool acceptable(const Hint& hint);

/// True when the record alone would pass parse_datagram under this hint. The sender uses it to drop
/// what no receiver would accept. A record does not depend on the hint's counts beyond
/// acceptable(hint).
bool acceptable(const EllipsoidRecord& record, const Hint& hint);
bool acceptable(const VertexRecord& record, const Hint& hint);

/// Builds one datagram of at most `capacity` bytes. It writes what it is told: hint, indices and
/// records are the caller's to keep acceptable. Of a vertex it writes what the hint's record format
/// has, and of a tag as many bits as it has there.
class DatagramWriter {
  public:
    /// Requires kLeastCapacity <= capacity <= kMaxDatagramBytes (asserted). Builds in the memory
    /// of `spent`, such as a datagram that was sent; its content is forgotten.
    DatagramWriter(const DatagramHeader& header, std::size_t capacity,
                   std::vector<std::uint8_t> spent = {});

    /// How many records still fit into a new section (0 when not even its header does).
    [[nodiscard]] std::size_t ellipsoids_that_fit() const;
    [[nodiscard]] std::size_t vertices_that_fit() const;
    [[nodiscard]] std::size_t edges_that_fit() const;

    /// Adds a section of records with indices first, first + stride, ... Requires that they fit,
    /// that there is at least one, and fewer than kMaxSections sections so far (asserted).
    void add_ellipsoids(std::uint32_t first, std::uint32_t stride,
                        const Strided<EllipsoidRecord>& records);
    void add_vertices(std::uint32_t first, std::uint32_t stride,
                      const Strided<VertexRecord>& records);
    /// Adds a section of edges, whose `among` must be the same (asserted). Requires the same of
    /// them and of the datagram.
    void add_edges(std::span<const EdgeRecord> edges);
    /// False, and nothing added, when it does not fit. Strings are cut to 255 bytes at a
    /// character's border, control characters and what is not UTF-8 replaced by '_'. Requires an
    /// origin that is finite and within kMaxCoordinate (asserted).
    [[nodiscard]] bool add_description(const Description& description);
    /// Likewise. Requires what encode_page does (asserted).
    [[nodiscard]] bool add_page(const PageEntry& entry);

    /// Appends the checksum and hands the bytes out; the writer is spent. Requires a section
    /// (asserted), for no receiver takes a datagram without.
    [[nodiscard]] std::vector<std::uint8_t> finish();

  private:
    [[nodiscard]] std::size_t free_bytes() const;
    [[nodiscard]] std::size_t record_room() const;  // bytes of records in a new section
    [[nodiscard]] bool add_body(SectionKind kind, std::span<const std::uint8_t> body);

    std::vector<std::uint8_t> bytes_;
    RecordFormat format_;
    std::size_t capacity_;
    std::size_t sections_ = 0;
};

/// Rewrites the RTP sequence number and timestamp of a finished datagram, and its checksum. Lets a
/// sender lay out a round once and stamp it at the moment of sending.
void stamp(std::span<std::uint8_t> datagram, std::uint16_t sequence, std::uint32_t timestamp);

}  // namespace ellicast::protocol
