// protocol/description.hpp: body of a description section, WIRE_FORMAT.md section 5.3.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/datagram.hpp"
#include "protocol/wire_layout.hpp"

namespace ellicast::protocol {

/// True when the body holds exactly one description that may be shown. Never allocates.
bool is_description(std::span<const std::uint8_t> body);

/// Requires is_description(body) (asserted).
Description decode_description(std::span<const std::uint8_t> body);

/// Body of the description after presentable() on each string. Requires a finite origin within
/// kMaxCoordinate (asserted).
std::vector<std::uint8_t> encode_description(const Description& description);

/// UTF-8 by [RFC 3629] (no overlong forms, no surrogates, at most U+10FFFF) without the control
/// characters U+0000-001F and U+007F-009F.
bool is_presentable(std::string_view text);

/// The text with every control character and every byte that is no UTF-8 replaced by '_', cut at a
/// character's border to at most so many bytes.
std::string presentable(std::string_view text, std::size_t most = kMaxStringBytes);

}  // namespace ellicast::protocol
