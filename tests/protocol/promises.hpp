// tests/protocol/promises.hpp
#pragma once

#include <span>
#include <string>

#include "protocol/datagram.hpp"

namespace ellicast::tests {

/// What whoever reads an accepted datagram relies on, checked anew and slowly: bounds of hint,
/// round, indices and records, and that the datagram survives being written again, filtered and
/// stamped. Gives the first promise broken, "" when all are kept. Requires that the bytes are
/// accepted.
std::string broken_promise(std::span<const std::uint8_t> datagram);

}  // namespace ellicast::tests
