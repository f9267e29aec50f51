#pragma once

#include <optional>

#include "receiver/reconstruction.hpp"

namespace ellicast::receiver {

/// The surface of the received ellipsoids alone, on a small grid: the first thing to show, a few
/// milliseconds after the first datagram. A closed, outward 2-manifold; all its vertices are
/// coarse. Nothing is chosen by topology, and of the reconstruction only mesh, vertex_index,
/// provenance, confidence, the number of missing vertices and isolevel are filled in. Empty when
/// the grid sees no ellipsoid. Same object, same bits, on any number of threads. Cost: 48 cells and
/// 400 ellipsoids take about 10 ms.
std::optional<Reconstruction> sketch(const ReceivedObject& object, int cells, unsigned threads);

}  // namespace ellicast::receiver
