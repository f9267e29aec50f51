// receiver/received_object.cpp
#include "receiver/received_object.hpp"

#include "common/object_id.hpp"
#include "protocol/object_table.hpp"

namespace ellicast::receiver {

bool is_complete(const ReceivedObject& object) {
    return object.ellipsoids.size() == object.hint.ellipsoids &&
           object.vertices.size() == object.hint.vertices;
}

bool id_matches(const ReceivedObject& object) {
    return is_complete(object) && protocol::object_id_of<common::Digest>(
                                      object.hint, object.ellipsoids, object.vertices) == object.id;
}

}  // namespace ellicast::receiver
