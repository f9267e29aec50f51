// receiver/output_files.hpp
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "receiver/received_object.hpp"
#include "receiver/reconstruction.hpp"

namespace ellicast::receiver {

/// The object id in hexadecimal; its name when no description arrived.
std::string id_text(const protocol::ObjectId& id);

/// What the sender calls the model; the id where it does not say.
std::string name_of(const ReceivedObject& object);

/// A file name without extension from a name that a stranger chose: its last path part, without
/// leading dots, dashes and spaces, with '_' for what some file system dislikes, at most so many
/// bytes of whole UTF-8 characters. Empty when nothing is left.
inline constexpr std::size_t kMaxStemBytes = 100;  // leaves room for suffixes below the usual 255
std::string safe_file_stem(std::string_view name, std::size_t most_bytes = kMaxStemBytes);

/// Whether the user named a directory: an existing one, or by a trailing '/'.
bool names_directory(const std::filesystem::path& output);

/// Where the mesh goes: `output` itself, or DIR/name.ply in a directory.
std::filesystem::path output_file(const std::filesystem::path& output, const ReceivedObject& object,
                                  std::size_t most_bytes = kMaxStemBytes);

/// Makes sure, before anything is received, that a file can be written there; makes the directory
/// where one is named. Throws common::ModelError with the path and the reason. Leaves an existing
/// file as it is.
void check_writable_file(const std::filesystem::path& path);
void check_writable_directory(const std::filesystem::path& path);

/// Writes the result; float32 unless that would move a received vertex (a large origin), double
/// then; with uchar red, green, blue when the object has colours (receiver/vertex_colours.hpp), and
/// unless every vertex was received and none is missing with
///   uchar provenance              0 received, 1 concealed, 2 coarse: Provenance
///   float distance_to_received    Confidence::distance, model units
///   float confidence              Confidence::completeness, 0 to 1
/// Atomic. Throws common::ModelError.
void write_mesh(const std::filesystem::path& path, const Reconstruction& reconstruction,
                const ReceivedObject& object);

/// Writes 1-ellipsoids.ply, 2-marching-cubes.ply, 3-halfway.ply and 4-final.ply, Figure 7 of
/// [BK02]. Requires stages (asserted). Throws common::ModelError.
void write_stages(const std::filesystem::path& directory, const Reconstruction& reconstruction,
                  const ReceivedObject& object);

}  // namespace ellicast::receiver
