// protocol/section_filter.hpp
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "protocol/datagram.hpp"

namespace ellicast::protocol {

/// The datagram without the sections that `keep` refuses, checksum made anew: the simulated loss of
/// --drop-ellipsoids and --drop-vertices. `keep` is asked once for each section of a known kind, in
/// order; unknown kinds stay. Empty when sections were refused and none remains: the datagram is
/// then lost whole. Bytes that parse_datagram refuses come back unchanged, for the receiver to
/// refuse. Header and order of what remains are those of before. Linear in the bytes.
std::optional<std::vector<std::uint8_t>> keep_sections(
    std::span<const std::uint8_t> datagram, const std::function<bool(const SectionView&)>& keep);

}  // namespace ellicast::protocol
