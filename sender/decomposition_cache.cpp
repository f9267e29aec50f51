// sender/decomposition_cache.cpp: key, writing and reading of a decomposition file.
//
// All numbers are little-endian; f64 is IEEE 754.
//   8  "ellidec" and a version byte
//  32  key, hex digits
//   8  u64 seeds tried
//   8  u64 candidates grown
//   8  f64 share covered
//   8  f64 share outside
//   8  u64 number of ellipsoids
//  72  f64 each: centre x y z, L row by row (l00 l10 l11 l20 l21 l22), for every ellipsoid
//  32  BLAKE2b of all before
#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <fstream>
#include <span>
#include <string_view>
#include <system_error>

#include "common/atomic_file.hpp"
#include "common/hex_text.hpp"
#include "common/model_io.hpp"
#include "common/object_id.hpp"
#include "sender/decomposition.hpp"

namespace ellicast::sender {
namespace {

using common::Ellipsoid;

// Part of the key as well: counts up when the file's layout or the result of decompose() changes,
// so that a newer program does not serve an older one's work.
constexpr std::uint8_t kVersion = 3;
constexpr std::string_view kMagic = "ellidec";
constexpr std::size_t kKeyBytes = 32;
constexpr std::size_t kHeaderBytes = 8 + kKeyBytes + 5 * sizeof(std::uint64_t);
constexpr std::size_t kEllipsoidBytes = 9 * sizeof(double);
constexpr std::size_t kChecksumBytes = 32;
constexpr std::uint64_t kMaxEllipsoids = 1u << 20;  // 75 MB; senders have at most 65535

class Bytes {
  public:
    void text(std::string_view value) { bytes_.append(value); }
    void u64(std::uint64_t value) {
        std::array<char, 8> le;
        for (std::size_t i = 0; i < 8; ++i) le[i] = static_cast<char>(value >> (8 * i));
        bytes_.append(le.data(), le.size());
    }
    void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }

    [[nodiscard]] const std::string& view() const { return bytes_; }
    void clear() { bytes_.clear(); }

  private:
    std::string bytes_;
};

// Reads what the caller has checked to be there.
class Cursor {
  public:
    explicit Cursor(std::string_view bytes) : rest_(bytes) {}
    std::string_view text(std::size_t size) {
        const std::string_view taken = rest_.substr(0, size);
        rest_.remove_prefix(size);
        return taken;
    }
    std::uint64_t u64() {
        std::uint64_t value = 0;
        const std::string_view le = text(8);
        for (std::size_t i = 0; i < 8; ++i) {
            value |= static_cast<std::uint64_t>(static_cast<std::uint8_t>(le[i])) << (8 * i);
        }
        return value;
    }
    double f64() { return std::bit_cast<double>(u64()); }

  private:
    std::string_view rest_;
};

std::span<const std::uint8_t> as_octets(std::string_view bytes) {
    return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::string checksum(std::string_view bytes) {
    common::Digest digest;
    digest.update(as_octets(bytes));
    const std::array<std::uint8_t, 32> sum = digest.finish32();
    return {reinterpret_cast<const char*>(sum.data()), sum.size()};
}

std::string preamble() {
    std::string bytes(kMagic);
    bytes.push_back(static_cast<char>(kVersion));
    return bytes;
}

// Feeds items to the digest in blocks, so that a large model is not copied whole.
template <class Items, class Append>
void digest_items(common::Digest& digest, const Items& items, const Append& append) {
    constexpr std::size_t kBlockBytes = 1u << 16;
    Bytes bytes;
    bytes.u64(items.size());
    for (const auto& item : items) {
        append(bytes, item);
        if (bytes.view().size() >= kBlockBytes) {
            digest.update(as_octets(bytes.view()));
            bytes.clear();
        }
    }
    digest.update(as_octets(bytes.view()));
}

// The file's bytes when it is an ordinary file of a size that a decomposition can have; else "".
std::string read_bounded(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error) || error) return {};
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error || size < kHeaderBytes + kChecksumBytes ||
        size > kHeaderBytes + kChecksumBytes + kMaxEllipsoids * kEllipsoidBytes) {
        return {};
    }
    std::string bytes(static_cast<std::size_t>(size), '\0');
    std::ifstream in(path, std::ios::binary);
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!in || in.gcount() != static_cast<std::streamsize>(bytes.size())) return {};
    return bytes;
}

std::optional<Ellipsoid> read_ellipsoid(Cursor& cursor) {
    Ellipsoid ellipsoid;
    for (Eigen::Index i = 0; i < 3; ++i) ellipsoid.center[i] = cursor.f64();
    ellipsoid.L.setZero();
    for (Eigen::Index row = 0; row < 3; ++row) {
        for (Eigen::Index column = 0; column <= row; ++column) {
            ellipsoid.L(row, column) = cursor.f64();
        }
    }
    const bool valid = ellipsoid.center.allFinite() && ellipsoid.L.allFinite() &&
                       ellipsoid.L.diagonal().minCoeff() > 0.0;
    if (!valid) return std::nullopt;
    return ellipsoid;
}

bool is_share(double value) {
    return std::isfinite(value) && value >= 0.0;
}

// A checksum proves that the file is whole, not that its writer was honest: every value is checked.
std::optional<Decomposition> parse(std::string_view bytes, const std::string& key) {
    const std::string_view body = bytes.substr(0, bytes.size() - kChecksumBytes);
    Cursor cursor(body);
    if (cursor.text(8) != preamble() || cursor.text(kKeyBytes) != key) return std::nullopt;
    if (checksum(body) != bytes.substr(body.size())) return std::nullopt;
    Decomposition decomposition;
    decomposition.seeds = cursor.u64();
    decomposition.candidates = cursor.u64();
    decomposition.covered = cursor.f64();
    decomposition.outside = cursor.f64();
    const std::uint64_t count = cursor.u64();
    const std::size_t available = (body.size() - kHeaderBytes) / kEllipsoidBytes;
    if (count != available || body.size() != kHeaderBytes + available * kEllipsoidBytes ||
        !is_share(decomposition.covered) || !is_share(decomposition.outside)) {
        return std::nullopt;
    }
    decomposition.ellipsoids.reserve(available);
    for (std::size_t i = 0; i < available; ++i) {
        const std::optional<Ellipsoid> ellipsoid = read_ellipsoid(cursor);
        if (!ellipsoid) return std::nullopt;
        decomposition.ellipsoids.push_back(*ellipsoid);
    }
    return decomposition;
}

}  // namespace

std::string decomposition_key(const common::TriangleMesh& solid,
                              const DecompositionOptions& options) {
    common::Digest digest;
    Bytes bytes;
    bytes.text(preamble());
    bytes.u64(options.ellipsoids);
    bytes.u64(options.candidates);
    bytes.u64(static_cast<std::uint64_t>(options.criterion));
    bytes.f64(options.expected_loss);
    bytes.u64(static_cast<std::uint64_t>(options.refine));
    bytes.u64(static_cast<std::uint64_t>(options.grid));
    bytes.u64(static_cast<std::uint64_t>(options.presmooth));
    bytes.f64(options.epsilon);
    bytes.f64(options.facet_edge);
    bytes.f64(options.max_aspect);
    bytes.u64(options.seed);
    digest.update(as_octets(bytes.view()));
    digest_items(digest, solid.positions, [](Bytes& out, const Eigen::Vector3d& p) {
        for (Eigen::Index i = 0; i < 3; ++i) out.f64(p[i]);
    });
    digest_items(digest, solid.triangles, [](Bytes& out, const common::Triangle& t) {
        for (const std::uint32_t corner : t) out.u64(corner);
    });
    const std::array<std::uint8_t, 32> sum = digest.finish32();
    return common::hex_text(std::span(sum).first(kKeyBytes / 2));
}

void write_decomposition(const std::filesystem::path& path, const std::string& key,
                         const Decomposition& decomposition) {
    assert(key.size() == kKeyBytes);
    Bytes bytes;
    bytes.text(preamble());
    bytes.text(key);
    bytes.u64(decomposition.seeds);
    bytes.u64(decomposition.candidates);
    bytes.f64(decomposition.covered);
    bytes.f64(decomposition.outside);
    bytes.u64(decomposition.ellipsoids.size());
    for (const Ellipsoid& ellipsoid : decomposition.ellipsoids) {
        for (Eigen::Index i = 0; i < 3; ++i) bytes.f64(ellipsoid.center[i]);
        for (Eigen::Index row = 0; row < 3; ++row) {
            for (Eigen::Index column = 0; column <= row; ++column) {
                bytes.f64(ellipsoid.L(row, column));
            }
        }
    }
    bytes.text(checksum(bytes.view()));
    try {
        common::write_file_atomically(path, bytes.view());
    } catch (const common::WriteFailure& failure) {
        throw common::ModelError(path.string() + ": " + failure.what());
    }
}

std::optional<Decomposition> read_decomposition(const std::filesystem::path& path,
                                                const std::string& key) {
    const std::string bytes = read_bounded(path);
    if (bytes.empty()) return std::nullopt;
    return parse(bytes, key);
}

}  // namespace ellicast::sender
