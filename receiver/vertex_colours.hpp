// receiver/vertex_colours.hpp
#pragma once

#include <vector>

#include "common/triangle_mesh.hpp"
#include "receiver/received_object.hpp"
#include "receiver/reconstruction.hpp"

namespace ellicast::receiver {

/// A colour for every vertex of the result: received ones have their own, and any other the mean of
/// those of its neighbours that are fewer edges away from a received vertex than itself. Where no
/// edges lead to a received vertex, the mean of all received; grey when there are none. Empty when
/// the object has no colours. A function of its inputs; linear in the mesh.
std::vector<common::Colour> vertex_colours(const Reconstruction& reconstruction,
                                           const ReceivedObject& object);

}  // namespace ellicast::receiver
