// protocol/page.hpp: body of a page section, WIRE_FORMAT.md section 5.4.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/datagram.hpp"

namespace ellicast::protocol {

/// True when the body holds exactly one page entry that may be believed and shown. Never allocates.
bool is_page(std::span<const std::uint8_t> body);

/// Requires is_page(body) (asserted).
PageEntry decode_page(std::span<const std::uint8_t> body);

/// The name as presentable(), cut to kMaxPageNameBytes. Requires page < pages, version >= 1 and
/// components >= 1 (asserted).
std::vector<std::uint8_t> encode_page(const PageEntry& entry);

}  // namespace ellicast::protocol
